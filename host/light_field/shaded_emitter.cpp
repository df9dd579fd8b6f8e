// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/shaded_emitter.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace mf {

std::optional<float> ShadedEmitter::met_at(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                           float scale) const {
  const Eigen::Vector3f to = emitter.position - origin;
  const float along = to.dot(direction), reach = scale * emitter.radius_m;
  if (along <= 0 || to.squaredNorm() - along * along > reach * reach) return std::nullopt;
  return along;
}

Eigen::Vector3f ShadedEmitter::occluder_point(const Eigen::Vector2f& m, float share) const {
  const Eigen::Vector3f on_plane(m.x(), m.y(), plane_height_m);
  return emitter.position + (1 - share) * (on_plane - emitter.position);
}

Eigen::Vector2f ShadedEmitter::mask_texel(const Eigen::Vector3f& p, const Eigen::Vector3f& direction,
                                          float share) const {
  const float along = (emitter.position - p).dot(direction);
  const Eigen::Vector3f from_emitter = p + share * along * direction - emitter.position;
  const Eigen::Vector2f m =
      (emitter.position + from_emitter * ((plane_height_m - emitter.position.z()) / from_emitter.z())).head<2>();
  const Eigen::Vector2f size = mask_max_m - mask_min_m;
  return {std::clamp((m.x() - mask_min_m.x()) / size.x() * static_cast<float>(mask.width), 0.5F,
                     static_cast<float>(mask.width) - 0.5F),
          std::clamp((mask_max_m.y() - m.y()) / size.y() * static_cast<float>(mask.height), 0.5F,
                     static_cast<float>(mask.height) - 0.5F)};
}

// The share depends on where the ray passes, and that on the share: a fixed point, near at once since shares vary
// slowly and rays to one small emitter lie close together.
ShadedEmitter::Passage ShadedEmitter::passage(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const {
  Passage at{occluder_share, mask_texel(p, direction, occluder_share)};
  constexpr int rounds = 3;
  for (int i = 0; i < rounds; ++i) {
    const float share = mask.at(static_cast<int>(at.texel.x()), static_cast<int>(at.texel.y()), 2);
    if (share == at.share) break;
    at = {share, mask_texel(p, direction, share)};
  }
  return at;
}

float ShadedEmitter::share_along(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const {
  return mask.empty() ? occluder_share : passage(p, direction).share;
}

std::optional<float> ShadedEmitter::visibility(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const {
  if (mask.empty()) return std::nullopt;
  const Eigen::Vector2f at = passage(p, direction).texel.array() - 0.5F;
  const float x = at.x(), y = at.y();
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, mask.width - 1), y1 = std::min(y0 + 1, mask.height - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  float sum = 0, weights = 0;
  const auto add = [&](int tx, int ty, float share) {
    const float w = share * mask.at(tx, ty, 1);
    sum += w * mask.at(tx, ty, 0);
    weights += w;
  };
  add(x0, y0, (1 - fx) * (1 - fy));
  add(x1, y0, fx * (1 - fy));
  add(x0, y1, (1 - fx) * fy);
  add(x1, y1, fx * fy);
  if (weights <= 0) return std::nullopt;
  return sum / weights;
}

const ShadedEmitter* emitter_met(std::span<const ShadedEmitter> emitters, const Eigen::Vector3f& origin,
                                 const Eigen::Vector3f& direction) {
  for (const ShadedEmitter& e : emitters)
    if (e.met_at(origin, direction)) return &e;
  return nullptr;
}

bool may_meet_emitter(std::span<const ShadedEmitter> emitters, const Eigen::Vector3f& p,
                      const Eigen::Vector3f& direction, float angle_rad) {
  return std::any_of(emitters.begin(), emitters.end(), [&](const ShadedEmitter& e) {
    const Eigen::Vector3f to = e.emitter.position - p;
    const float along = to.dot(direction);
    return along > 0 && to.cross(direction).norm() < e.emitter.radius_m + angle_rad * along;
  });
}

}  // namespace mf
