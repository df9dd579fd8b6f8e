// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/surroundings_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/blending/view_weights.h"
#include "host/light_field/view_rays.h"

namespace mf {

namespace {

constexpr float voting_weight = 0.5F;      // views nearer to their border than this do not vote
constexpr float darkest_radiance = 1e-4F;  // below, the logarithm only magnifies noise

// log2 luminance of what a view shows of the proxy point, over about `angle_rad`; nothing when it does not see it.
std::optional<float> log_luminance(const FieldView& view, const ProxyPoint& x, float angle_rad) {
  const Eigen::Vector3f pixel = pixel_of(view, x);
  if (pixel.z() <= 0) return std::nullopt;
  const Eigen::Vector4f seen =
      view.fetch(level_for_angle(view, x, angle_rad), pixel.x() / pixel.z(), pixel.y() / pixel.z());
  if (seen.w() < voting_weight) return std::nullopt;
  return std::log2(std::max(shown_luminance(seen), darkest_radiance));
}

// Mean distance from the median, each at most `limit`: what a view behind an occluder says counts once, not fully.
double robust_spread(std::vector<float>& values, float limit) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const float median = *middle;
  double sum = 0;
  for (const float v : values) sum += static_cast<double>(std::min(std::abs(v - median), limit));
  return sum / static_cast<double>(values.size());
}

}  // namespace

Eigen::Vector3f centre_of(const PlaneRectangle& rectangle) {
  const Eigen::Vector2d middle = 0.5 * (rectangle.min_m + rectangle.max_m);
  return (rectangle.world_from_plane * Eigen::Vector3d(middle.x(), middle.y(), 0)).cast<float>();
}

// ---- one sphere ----

namespace {

constexpr int test_directions = 400;
constexpr int test_points = 4;  // along each side of the rectangle
constexpr float sphere_angle_rad =
    0.025F;  // what is compared: coarser than noise and calibration errors, finer than walls

struct TestRay {
  Eigen::Vector3f p;
  Eigen::Vector3f direction;
};

std::vector<TestRay> test_rays(const PlaneRectangle& rectangle) {
  const DirectionSet set = geodesic_hemisphere(test_directions);
  std::vector<TestRay> rays;
  for (const Eigen::Vector3f& d : set.directions)
    for (int y = 0; y < test_points; ++y)
      for (int x = 0; x < test_points; ++x) {
        const Eigen::Vector2d f((x + 0.5) / test_points, (y + 0.5) / test_points);
        const Eigen::Vector2d p = rectangle.min_m + f.cwiseProduct(rectangle.size_m());
        rays.push_back({(rectangle.world_from_plane * Eigen::Vector3d(p.x(), p.y(), 0)).cast<float>(),
                        rectangle.world_from_plane.rotation.cast<float>() * d});
      }
  return rays;
}

// How much the k views nearest to the ray differ; nothing when too few of them saw it.
std::optional<double> inconsistency(const std::vector<FieldView>& views, const TestRay& ray, const ProxyPoint& x,
                                    int k) {
  std::vector<std::pair<float, float>> answers;  // penalty, log2 luminance
  for (const FieldView& view : views)
    if (const auto value = log_luminance(view, x, sphere_angle_rad))
      answers.emplace_back(ray_distance(ray.p, x, view.centre_in_world), *value);
  const std::size_t wanted = static_cast<std::size_t>(std::max(k, 4));
  if (answers.size() < wanted) return std::nullopt;
  std::partial_sort(answers.begin(), answers.begin() + static_cast<std::ptrdiff_t>(wanted), answers.end());
  std::vector<float> logs;
  for (std::size_t i = 0; i < wanted; ++i) logs.push_back(answers[i].second);
  return robust_spread(logs, std::numeric_limits<float>::infinity());
}

}  // namespace

std::vector<SphereScore> score_spheres(const std::vector<FieldView>& views, const PlaneRectangle& rectangle, int k) {
  const double smallest = 1.2 * 0.5 * rectangle.size_m().norm();
  std::vector<SphereScore> scores;
  for (const double radius :
       {0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 16.0, std::numeric_limits<double>::infinity()})
    if (radius > smallest) scores.push_back({radius, 0});
  const std::vector<TestRay> rays = test_rays(rectangle);
  std::vector<Surroundings> spheres;
  spheres.reserve(scores.size());
  for (const SphereScore& s : scores) spheres.push_back(sphere_surroundings(centre_of(rectangle), s.radius_m));
  std::vector<std::vector<double>> spread(rays.size());
  tbb::parallel_for(std::size_t{0}, rays.size(), [&](std::size_t r) {
    for (const Surroundings& sphere : spheres) {
      const float inverse = sphere.inverse_distance_along(rays[r].p, rays[r].direction);
      const auto value = inconsistency(views, rays[r], proxy_point(rays[r].p, rays[r].direction, inverse), k);
      if (!value) {  // every radius is judged by the same rays
        spread[r].clear();
        return;
      }
      spread[r].push_back(*value);
    }
  });
  for (std::size_t i = 0; i < scores.size(); ++i) {
    double sum = 0, count = 0;
    for (const auto& values : spread)
      if (!values.empty()) {
        sum += values[i];
        count += 1;
      }
    scores[i].inconsistency = count > 0 ? sum / count : std::numeric_limits<double>::infinity();
  }
  return scores;
}

// ---- a distance per direction ----

namespace {

constexpr int map_size = 96;           // cells along the equal-area square: about 1.5° each
constexpr int level_count = 28;        // inverse distances, evenly from 0
constexpr float nearest_share = 0.8F;  // of the rectangle's half diagonal: nothing nearer is looked for
constexpr float sweep_angle_rad = 0.015F;
constexpr float occluded_stops = 1.0F;  // a vote further off than this counts as this
constexpr std::size_t fewest_votes = 4;
constexpr float doubt_votes = 8;               // a cost counts as if so many further votes had said doubt_stops:
constexpr float doubt_stops = 0.6F;            // few views that happen to agree are no evidence
constexpr float far_preference_stops = 0.05F;  // by which the nearest level must be better than the farthest
constexpr float emitter_margin_m = 0.1F;  // by about so much the views blended for a ray pass it by: so far off the
                                          // emitter still shows in one of them, and must show in its place
constexpr float smoothing_cells = 1.3F;   // σ over directions

using CostVolume = std::vector<ImageF>;  // one picture a level; infinite where too few views vote

float cost_of(std::vector<float>& votes, int level) {
  const float n = static_cast<float>(votes.size()), spread = static_cast<float>(robust_spread(votes, occluded_stops));
  return (n * spread + doubt_votes * doubt_stops) / (n + doubt_votes) +
         far_preference_stops * static_cast<float>(level) / (level_count - 1);
}

CostVolume sweep(const std::vector<FieldView>& views, const Eigen::Vector3f& centre, float level_step,
                 const Team& team) {
  CostVolume cost(static_cast<std::size_t>(level_count),
                  ImageF(map_size, map_size, 1, std::numeric_limits<float>::infinity()));
  tbb::parallel_for(0, map_size, [&](int y) {
    if (!team.has(static_cast<std::size_t>(y))) return;
    std::vector<float> votes;
    for (int x = 0; x < map_size; ++x) {
      const Eigen::Vector3f d =
          equal_area_direction(Eigen::Vector2f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F) / map_size);
      for (int level = 0; level < level_count; ++level) {
        const ProxyPoint point = proxy_point(centre, d, static_cast<float>(level) * level_step);
        votes.clear();
        for (const FieldView& view : views)
          if (const auto value = log_luminance(view, point, sweep_angle_rad)) votes.push_back(*value);
        if (votes.size() >= fewest_votes) cost[static_cast<std::size_t>(level)].at(x, y) = cost_of(votes, level);
      }
    }
  });
  for (ImageF& level : cost) share_rows(team, level);
  return cost;
}

// Gaussian over directions; cells without a cost are left out, and filled from their neighbours.
ImageF smoothed(const ImageF& cost) {
  const int reach = static_cast<int>(std::ceil(3 * smoothing_cells));
  ImageF out(cost.width, cost.height, 1, std::numeric_limits<float>::infinity());
  for (int y = 0; y < cost.height; ++y)
    for (int x = 0; x < cost.width; ++x) {
      float sum = 0, weights = 0;
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx) {
          const int tx = x + dx, ty = y + dy;
          if (tx < 0 || ty < 0 || tx >= cost.width || ty >= cost.height || !std::isfinite(cost.at(tx, ty))) continue;
          const float w = std::exp(-0.5F * static_cast<float>(dx * dx + dy * dy) / (smoothing_cells * smoothing_cells));
          sum += w * cost.at(tx, ty);
          weights += w;
        }
      if (weights > 0) out.at(x, y) = sum / weights;
    }
  return out;
}

// The level of least cost, between levels by a parabola; and how far the mean cost lies above it, relative.
struct BestLevel {
  float level = 0;
  float confidence = 0;
};
BestLevel best_level(const CostVolume& cost, int x, int y) {
  const auto at = [&](int level) { return cost[static_cast<std::size_t>(level)].at(x, y); };
  int best = 0, counted = 0;
  float mean = 0;
  for (int level = 0; level < level_count; ++level) {
    if (!std::isfinite(at(level))) continue;
    mean += at(level);
    ++counted;
    if (at(level) < at(best)) best = level;
  }
  if (counted == 0) return {};
  mean /= static_cast<float>(counted);
  BestLevel out{static_cast<float>(best), mean > 0 ? std::clamp(1 - at(best) / mean, 0.0F, 1.0F) : 0};
  if (best > 0 && best + 1 < level_count && std::isfinite(at(best - 1)) && std::isfinite(at(best + 1))) {
    const float curvature = at(best - 1) - 2 * at(best) + at(best + 1);
    if (curvature > 0) out.level += std::clamp(0.5F * (at(best - 1) - at(best + 1)) / curvature, -0.5F, 0.5F);
  }
  return out;
}

ImageF median_of_nine(const ImageF& in) {
  ImageF out = in;
  for (int y = 1; y + 1 < in.height; ++y)
    for (int x = 1; x + 1 < in.width; ++x) {
      std::array<float, 9> window{};
      std::size_t n = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) window[n++] = in.at(x + dx, y + dy);
      std::nth_element(window.begin(), window.begin() + 4, window.end());
      out.at(x, y) = window[4];
    }
  return out;
}

// An emitter is what matters most and what a leaf before it hides best: its directions get its distance.
void set_distance(Surroundings& s, const Emitter& emitter) {
  const Eigen::Vector3f to = emitter.position - s.centre_in_world;
  const float distance = to.norm(), reach = (emitter.radius_m + emitter_margin_m) / distance;
  for (int y = 0; y < map_size; ++y)
    for (int x = 0; x < map_size; ++x) {
      const Eigen::Vector3f d =
          equal_area_direction(Eigen::Vector2f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F) / map_size);
      if (d.cross(to / distance).norm() > reach || d.dot(to) < 0) continue;
      s.inverse_distance.at(x, y) = 1 / distance;
      s.confidence.at(x, y) = 1;
    }
}

}  // namespace

Surroundings find_surroundings(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                               std::span<const Emitter> emitters, const Team& team) {
  const float nearest_m = nearest_share * 0.5F * static_cast<float>(rectangle.size_m().norm());
  const float level_step = 1 / nearest_m / static_cast<float>(level_count - 1);
  Surroundings s;
  s.centre_in_world = centre_of(rectangle);
  CostVolume cost = sweep(views, s.centre_in_world, level_step, team);
  tbb::parallel_for(std::size_t{0}, cost.size(), [&](std::size_t level) { cost[level] = smoothed(cost[level]); });
  s.inverse_distance = ImageF(map_size, map_size, 1);
  s.confidence = ImageF(map_size, map_size, 1);
  for (int y = 0; y < map_size; ++y)
    for (int x = 0; x < map_size; ++x) {
      const BestLevel best = best_level(cost, x, y);
      s.inverse_distance.at(x, y) = best.level * level_step;
      s.confidence.at(x, y) = best.confidence;
    }
  s.inverse_distance = median_of_nine(s.inverse_distance);
  for (const Emitter& emitter : emitters) set_distance(s, emitter);
  return s;
}

}  // namespace mf
