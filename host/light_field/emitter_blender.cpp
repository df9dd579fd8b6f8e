// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/emitter_blender.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "host/blending/view_weights.h"
#include "host/light_field/view_rays.h"

namespace mf {

namespace {

constexpr int most_views = 4;           // that speak for a ray: the fewer, the sharper an occluder's edge
constexpr float ghost_margin = 1.25F;   // times the radius: a view's ray this near to the ball shows some of its glare
constexpr float ghost_reach_m = 0.12F;  // as far beside an emitter a blended view may still show it
constexpr float smallest_weight = 0.02F;  // a view that shows less than this of the ray does not speak for it
constexpr float same_ray_m = 1e-3F;

struct Answer {
  float penalty = 0;
  Eigen::Vector4f seen;  // premultiplied
};

// What the views say of a ray that meets the emitter, when focused on the occluder; only views that look at the emitter
// through that point.
void ask_about_emitter(const std::vector<FieldView>& views, std::span<const std::uint32_t> candidates,
                       const ShadedEmitter& e, const Eigen::Vector3f& p, const Eigen::Vector3f& direction,
                       float angle_rad, std::vector<Answer>& answers) {
  const float along = (e.emitter.position - p).dot(direction);
  const ProxyPoint x = proxy_point(p, direction, 1 / (e.occluder_share * along));
  for (const std::uint32_t v : candidates) {
    const FieldView& view = views[v];
    if (!e.met_at(view.centre_in_world, ray_to(x, view.centre_in_world).normalized())) continue;
    const Eigen::Vector3f pixel = pixel_of(view, x);
    if (pixel.z() <= 0) continue;
    const Eigen::Vector4f seen =
        view.fetch(level_for_angle(view, x, angle_rad), pixel.x() / pixel.z(), pixel.y() / pixel.z());
    if (seen.w() >= smallest_weight) answers.push_back({ray_distance(p, x, view.centre_in_world) / seen.w(), seen});
  }
}

// Points on the disc under which the emitter is seen from p: directions.
std::vector<Eigen::Vector3f> directions_to(const Emitter& e, const Eigen::Vector3f& p) {
  const Eigen::Vector3f to = (e.position - p).normalized(), x = to.unitOrthogonal(), y = to.cross(x);
  std::vector<Eigen::Vector3f> directions{to};
  for (int i = 0; i < 6; ++i) {
    const float a = static_cast<float>(i) * 1.0471976F;
    directions.push_back((e.position + 0.6F * e.radius_m * (std::cos(a) * x + std::sin(a) * y) - p).normalized());
  }
  return directions;
}

float log_luminance(const Eigen::Vector4f& seen) {
  return std::log2(std::max((0.2126F * seen.x() + 0.7152F * seen.y() + 0.0722F * seen.z()) / seen.w(), 1e-3F));
}

// How much the views nearest to a ray differ about the emitter's being hidden; stops.
double disagreement(const std::vector<FieldView>& views, const ShadedEmitter& e,
                    const std::vector<Eigen::Vector3f>& points) {
  constexpr float angle_rad = 0.006F;
  constexpr std::size_t nearest = 5;
  std::vector<std::uint32_t> all(views.size());
  std::iota(all.begin(), all.end(), 0U);
  double sum = 0, count = 0;
  std::vector<Answer> answers;
  for (const Eigen::Vector3f& p : points)
    for (const Eigen::Vector3f& d : directions_to(e.emitter, p)) {
      answers.clear();
      ask_about_emitter(views, all, e, p, d, angle_rad, answers);
      if (answers.size() < nearest) continue;
      std::partial_sort(answers.begin(), answers.begin() + nearest, answers.end(),
                        [](const Answer& a, const Answer& b) { return a.penalty < b.penalty; });
      double mean = 0, square = 0;
      for (std::size_t i = 0; i < nearest; ++i) {
        const double v = static_cast<double>(log_luminance(answers[i].seen));
        mean += v / nearest;
        square += v * v / nearest;
      }
      sum += std::sqrt(std::max(0.0, square - mean * mean));
      count += 1;
    }
  return count > 0 ? sum / count : 0;
}

// The share of least disagreement: tried evenly, then more finely about the best.
float find_occluder(const std::vector<FieldView>& views, const ShadedEmitter& e,
                    const std::vector<Eigen::Vector3f>& points) {
  const auto best_of = [&](float first, float step, int count) {
    std::vector<double> scores(static_cast<std::size_t>(count));
    tbb::parallel_for(std::size_t{0}, scores.size(), [&](std::size_t i) {
      ShadedEmitter tried = e;
      tried.occluder_share = first + step * static_cast<float>(i);
      scores[i] = disagreement(views, tried, points);
    });
    return first + step * static_cast<float>(std::min_element(scores.begin(), scores.end()) - scores.begin());
  };
  const float coarse = best_of(0.2F, 0.06F, 13);
  return best_of(coarse - 0.04F, 0.02F, 5);
}

// Every view whose ray through the occluder's point meets the emitter votes on how much light passes there.
void draw_mask(const std::vector<FieldView>& views, const PlaneRectangle& rectangle, ShadedEmitter& e) {
  constexpr int side = 192;
  constexpr float margin_m = 0.06F;  // rays to the emitter's rim pass the occluder beside its centre's shadow
  e.mask_min_m = (rectangle.world_from_plane * Eigen::Vector3d(rectangle.min_m.x(), rectangle.min_m.y(), 0))
                     .head<2>()
                     .cast<float>()
                     .array() -
                 margin_m;
  e.mask_max_m = (rectangle.world_from_plane * Eigen::Vector3d(rectangle.max_m.x(), rectangle.max_m.y(), 0))
                     .head<2>()
                     .cast<float>()
                     .array() +
                 margin_m;
  e.mask = ImageF(side, side, 2);
  const Eigen::Vector2f texel = (e.mask_max_m - e.mask_min_m) / side;
  const float full = std::max(e.radiance.sum(), 1e-6F);
  tbb::parallel_for(0, side, [&](int y) {
    for (int x = 0; x < side; ++x) {
      const Eigen::Vector2f m(e.mask_min_m.x() + (static_cast<float>(x) + 0.5F) * texel.x(),
                              e.mask_max_m.y() - (static_cast<float>(y) + 0.5F) * texel.y());
      const ProxyPoint q = e.occluder_point(m).homogeneous();
      float sum = 0, weights = 0;
      for (const FieldView& view : views) {
        constexpr float most = 1.5F;         // noise goes both ways: it must average out
        constexpr float well_inside = 0.7F;  // of the radius: pixels at the rim show half of what is beside the lamp
        if (!e.met_at(view.centre_in_world, ray_to(q, view.centre_in_world).normalized(), well_inside)) continue;
        const Eigen::Vector3f pixel = pixel_of(view, q);
        if (pixel.z() <= 0) continue;
        const Eigen::Vector4f seen = view.fetch(level_for_angle(view, q, texel.mean() * (1 - e.occluder_share)),
                                                pixel.x() / pixel.z(), pixel.y() / pixel.z());
        if (seen.w() < smallest_weight) continue;
        sum += std::min(seen.head<3>().sum() / full, most * seen.w());
        weights += seen.w();
      }
      if (weights <= 0) continue;
      e.mask.at(x, y, 0) = std::min(sum / weights, 1.0F);
      e.mask.at(x, y, 1) = std::min(weights, 1.0F);
    }
  });
}

// A coarse grid of the plane, world.
std::vector<Eigen::Vector3f> points_of(const PlaneRectangle& rectangle) {
  constexpr int side = 12;
  std::vector<Eigen::Vector3f> points;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const Eigen::Vector2d p =
          rectangle.min_m + Eigen::Vector2d((x + 0.5) / side, (y + 0.5) / side).cwiseProduct(rectangle.size_m());
      points.push_back((rectangle.world_from_plane * Eigen::Vector3d(p.x(), p.y(), 0)).cast<float>());
    }
  return points;
}

// The emitter's own radiance: the median of what views show of its centre where nothing hides it, since occluders only
// darken.
Eigen::Vector3f unhidden_radiance(const std::vector<FieldView>& views, const Emitter& e) {
  std::vector<std::pair<float, Eigen::Vector3f>> seen_by;
  for (const FieldView& view : views) {
    const ProxyPoint x = e.position.homogeneous();
    const Eigen::Vector3f pixel = pixel_of(view, x);
    if (pixel.z() <= 0) continue;
    const float angle = 0.4F * e.radius_m;  // of a point scaled to w = 1: metres across
    const Eigen::Vector4f seen =
        view.fetch(level_for_angle(view, x, angle), pixel.x() / pixel.z(), pixel.y() / pixel.z());
    if (seen.w() > 0.5F) seen_by.emplace_back(log_luminance(seen), seen.head<3>() / seen.w());
  }
  if (seen_by.empty()) return Eigen::Vector3f::Zero();
  std::sort(seen_by.begin(), seen_by.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  constexpr float half = 1;  // stop: darker than this below the upper quartile is hidden at least in part
  const float upper = seen_by[3 * seen_by.size() / 4].first;
  const auto lit = std::find_if(seen_by.begin(), seen_by.end(), [&](const auto& s) { return s.first > upper - half; });
  return (lit + (seen_by.end() - lit) / 2)->second;
}

}  // namespace

EmitterBlender::EmitterBlender(const std::vector<FieldView>& views, const Surroundings& surroundings,
                               std::span<const Emitter> emitters, const PlaneRectangle& rectangle)
    : views_(views), surroundings_(surroundings) {
  for (const Emitter& emitter : emitters) {
    ShadedEmitter shaded;
    shaded.emitter = emitter;
    shaded.radiance = unhidden_radiance(views, emitter);
    shaded.plane_height_m = static_cast<float>(rectangle.world_from_plane.translation.z());
    shaded.occluder_share = find_occluder(views, shaded, points_of(rectangle));
    draw_mask(views, rectangle, shaded);
    emitters_.push_back(std::move(shaded));
  }
}

bool EmitterBlender::concerns(const Eigen::Vector3f& p, const Eigen::Vector3f& direction, float angle_rad) const {
  return std::any_of(emitters_.begin(), emitters_.end(), [&](const ShadedEmitter& s) {
    const Eigen::Vector3f to = s.emitter.position - p;
    const float reach = (s.emitter.radius_m + ghost_reach_m) / to.norm() + angle_rad;
    return to.dot(direction) > 0 && to.cross(direction).norm() < reach * to.norm();
  });
}

const ShadedEmitter* EmitterBlender::met_by(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                            float scale) const {
  for (const ShadedEmitter& s : emitters_)
    if (s.met_at(origin, direction, scale)) return &s;
  return nullptr;
}

std::optional<Eigen::Vector3f> EmitterBlender::unhidden(const Eigen::Vector3f& p,
                                                        const Eigen::Vector3f& direction) const {
  const ShadedEmitter* met = met_by(p, direction, 1);
  return met != nullptr ? std::optional<Eigen::Vector3f>(met->radiance) : std::nullopt;
}

Eigen::Vector4f EmitterBlender::radiance(const Eigen::Vector3f& p, const Eigen::Vector3f& direction, float angle_rad,
                                         std::span<const std::uint32_t> candidates) const {
  thread_local std::vector<Answer> answers;  // called for every part of many cells: no allocation each time
  answers.clear();
  const ShadedEmitter* met = met_by(p, direction, 1);
  if (met != nullptr) {
    const auto visible = met->visibility(p, direction);
    if (visible) {
      const Eigen::Vector3f colour = *visible * met->radiance;
      return {colour.x(), colour.y(), colour.z(), 1};
    }
    ask_about_emitter(views_, candidates, *met, p, direction, angle_rad, answers);
  }
  if (answers.empty()) {
    const ProxyPoint x = proxy_point(p, direction, surroundings_.inverse_distance_along(p, direction));
    for (const std::uint32_t v : candidates) {
      const FieldView& view = views_[v];
      if (met == nullptr &&
          met_by(view.centre_in_world, ray_to(x, view.centre_in_world).normalized(), ghost_margin) != nullptr)
        continue;
      const Eigen::Vector3f pixel = pixel_of(view, x);
      if (pixel.z() <= 0) continue;
      const Eigen::Vector4f seen =
          view.fetch(level_for_angle(view, x, angle_rad), pixel.x() / pixel.z(), pixel.y() / pixel.z());
      if (seen.w() >= smallest_weight) answers.push_back({ray_distance(p, x, view.centre_in_world) / seen.w(), seen});
    }
  }
  std::array<ViewWeight, most_views> weights;
  thread_local std::vector<ViewPenalty> ranked;
  ranked.clear();
  for (std::uint32_t i = 0; i < answers.size(); ++i) ranked.push_back({i, answers[i].penalty});
  const std::size_t speaking = blend_weights(ranked, most_views, same_ray_m, weights);
  Eigen::Vector4f colour = Eigen::Vector4f::Zero();
  float confidence = 0;
  for (std::size_t i = 0; i < speaking; ++i) {
    const Eigen::Vector4f& seen = answers[weights[i].view].seen;
    colour += weights[i].weight / seen.w() * seen;
    confidence += seen.w();
  }
  return {colour.x(), colour.y(), colour.z(), std::min(1.0F, confidence)};
}

}  // namespace mf
