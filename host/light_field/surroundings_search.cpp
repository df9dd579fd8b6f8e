// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/surroundings_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/blending/view_weights.h"
#include "host/light_field/distance_sweep.h"
#include "host/light_field/view_rays.h"

namespace mf {

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

constexpr float emitter_margin_m = 0.1F;  // by about so much the views blended for a ray pass it by: so far off the
                                          // emitter still shows in one of them, and must show in its place

// The level of least cost, between levels by a parabola; and how far the mean cost lies above it, relative.
struct BestLevel {
  float level = 0;
  float confidence = 0;
};
BestLevel best_level(const DistanceSweep& sweep, int x, int y) {
  const auto at = [&](int level) { return sweep.cost[static_cast<std::size_t>(level)].at(x, y); };
  int best = 0;
  float sum = 0;
  for (int level = 0; level < sweep.levels(); ++level) {
    sum += at(level);
    if (at(level) < at(best)) best = level;
  }
  const float mean = sum / static_cast<float>(sweep.levels());
  BestLevel out{static_cast<float>(best), std::clamp(1 - at(best) / mean, 0.0F, 1.0F)};
  if (best > 0 && best + 1 < sweep.levels()) {
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
  const int side = s.inverse_distance.width;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const Eigen::Vector3f d = equal_area_direction(
          Eigen::Vector2f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F) / static_cast<float>(side));
      if (d.cross(to / distance).norm() > reach || d.dot(to) < 0) continue;
      s.inverse_distance.at(x, y) = 1 / distance;
      s.confidence.at(x, y) = 1;
    }
}

}  // namespace

Surroundings find_surroundings(const DistanceSweep& sweep, std::span<const Emitter> emitters) {
  Surroundings s;
  s.centre_in_world = sweep.centre_in_world;
  s.inverse_distance = ImageF(sweep.side(), sweep.side(), 1);
  s.confidence = ImageF(sweep.side(), sweep.side(), 1);
  for (int y = 0; y < sweep.side(); ++y)
    for (int x = 0; x < sweep.side(); ++x) {
      const BestLevel best = best_level(sweep, x, y);
      s.inverse_distance.at(x, y) = best.level * sweep.level_step;
      s.confidence.at(x, y) = best.confidence;
    }
  s.inverse_distance = median_of_nine(s.inverse_distance);
  for (const Emitter& emitter : emitters) set_distance(s, emitter);
  return s;
}

}  // namespace mf
