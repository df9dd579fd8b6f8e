// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/mirror_plate.h"

#include <cmath>

namespace mf::sim {

namespace {

const Rgb back{0.1F, 0.1F, 0.1F};
constexpr double margin_m = 0.004;  // paper beyond the outermost tags' own white margin

}  // namespace

MirrorPlate::MirrorPlate(const MirrorTarget& target, double reflectance)
    : target_(target), half_size_(0.5 * target.opening_m), reflectance_(static_cast<float>(reflectance)) {
  for (const PlanarTag& tag : target.tags) {
    tags_.add(target.family, tag.id, tag.centre_m, tag.size_m);
    const TagPattern pattern = tag_pattern(target.family, tag.id);
    const double half_grid = 0.5 * tag.size_m * pattern.cells / pattern.border_cells + margin_m;
    half_size_ = half_size_.cwiseMax((tag.centre_m.cwiseAbs().array() + half_grid).matrix());
  }
}

MirrorPlate::Placement::Placement(const Rigid3& world_from_mirror)
    : mirror_from_world_rotation(world_from_mirror.rotation.conjugate().toRotationMatrix()),
      mirror_from_world_translation(world_from_mirror.inverse().translation) {}

std::optional<MirrorPlate::Hit> MirrorPlate::intersect(const Placement& placement, const Ray& ray, float nearest,
                                                       float farthest) const {
  // The height above the plate first: most rays miss it.
  const Eigen::Vector3d ray_origin = ray.origin.cast<double>();
  const Eigen::Vector3d ray_direction = ray.direction.cast<double>();
  const Eigen::Matrix3d& rotation = placement.mirror_from_world_rotation;
  const double height = rotation.row(2).dot(ray_origin) + placement.mirror_from_world_translation.z();
  const double distance = -height / rotation.row(2).dot(ray_direction);
  if (!(distance > nearest && distance < farthest)) return std::nullopt;
  const Eigen::Vector3d x_in_world = ray_origin + distance * ray_direction;
  const Eigen::Vector2d p = rotation.topRows<2>() * x_in_world + placement.mirror_from_world_translation.head<2>();
  if (std::abs(p.x()) > half_size_.x() || std::abs(p.y()) > half_size_.y()) return std::nullopt;

  return Hit{static_cast<float>(distance), height > 0, p.cast<float>()};
}

bool MirrorPlate::is_mirror(const Hit& hit) const {
  return hit.front && (hit.p.cwiseAbs().array() <= 0.5F * target_.opening_m.cast<float>().array()).all();
}

Rgb MirrorPlate::albedo(const Hit& hit) const {
  if (!hit.front) return back;
  return tags_.is_white(hit.p).value_or(true) ? paper : ink;
}

}  // namespace mf::sim
