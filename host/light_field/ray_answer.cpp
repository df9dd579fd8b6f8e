// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/ray_answer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "host/blending/view_weights.h"
#include "host/light_field/view_rays.h"

namespace mf {

namespace {

constexpr float least_answer = 0.02F;  // a view that shows less than this of the ray does not speak for it
constexpr float equal_rays = 1e-4F;    // metres (plane proxy: radians): rays closer than this are the same

float angle_between(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

struct Answering {
  std::uint32_t view = 0;
  RayTerms terms;
  Eigen::Vector4f seen;  // premultiplied
};

std::optional<Answering> ask(const FieldView& view, std::uint32_t index, const Surroundings& surroundings,
                             const WantedRay& ray, const ProxyPoint& x, const AnswerOptions& options) {
  if (options.emitters != nullptr && options.emitters->shown_by(view, x, ray.angle_rad)) return std::nullopt;
  const Eigen::Vector3f pixel = pixel_of(view, x);
  if (pixel.z() <= 0) return std::nullopt;
  const float visible = options.visibility != nullptr ? options.visibility->of_view(index, x) : 1.0F;
  const Eigen::Vector4f seen =
      visible * view.fetch(level_for_angle(view, x, ray.angle_rad), pixel.x() / pixel.z(), pixel.y() / pixel.z());
  if (seen.w() < least_answer) return std::nullopt;
  RayTerms terms;
  terms.angle = surroundings.is_plane() ? angle_between(ray_to(x, view.centre_in_world), ray.direction)
                                        : ray_distance(ray.p, x, view.centre_in_world);
  const float pixels = ray.angle_rad / ray_to(x, view.centre_in_world).norm() * view.focal_px;
  terms.resolution = coarseness(pixels * pixels, 1);
  terms.weight = seen.w();
  return Answering{index, terms, seen};
}

}  // namespace

RayAnswer answer_of(std::span<const FieldView> views, const Surroundings& surroundings, const WantedRay& ray,
                    const AnswerOptions& options) {
  const float inverse = surroundings.is_plane() ? 0.0F : surroundings.inverse_distance_along(ray.p, ray.direction);
  const ProxyPoint x =
      surroundings.is_plane() ? ProxyPoint(ray.p.homogeneous()) : proxy_point(ray.p, ray.direction, inverse);
  std::vector<Answering> answering;
  std::vector<ViewPenalty> ranked;
  for (std::uint32_t i = 0; i < views.size(); ++i) {
    if (options.except == i) continue;
    const auto answer = ask(views[i], i, surroundings, ray, x, options);
    if (!answer) continue;
    ranked.push_back({static_cast<std::uint32_t>(answering.size()), penalty_of(options.penalty, answer->terms)});
    answering.push_back(*answer);
  }
  std::vector<ViewWeight> weights(static_cast<std::size_t>(options.penalty.k));
  weights.resize(blend_weights(ranked, options.penalty.k, equal_rays, weights));
  std::sort(weights.begin(), weights.end(),
            [](const ViewWeight& a, const ViewWeight& b) { return a.weight > b.weight; });
  RayAnswer result;
  for (const ViewWeight& w : weights) {
    const Answering& a = answering[w.view];
    const Eigen::Vector3f shown = a.seen.head<3>() / a.seen.w();
    result.speaking.push_back({a.view, w.weight, a.terms, shown});
    result.radiance += w.weight * shown;
    result.confidence += a.seen.w();
  }
  result.confidence = std::min(result.confidence, 1.0F);
  return result;
}

}  // namespace mf
