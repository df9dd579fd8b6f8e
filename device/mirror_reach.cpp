// SPDX-License-Identifier: Apache-2.0
#include "device/mirror_reach.h"

#include <algorithm>
#include <cmath>

namespace mf {

namespace {

using Eigen::Vector3d;

// Columns: the mirror's axes. Nothing when `right` is along the normal.
std::optional<Eigen::Matrix3d> facing(const Vector3d& normal, const Vector3d& right) {
  const Vector3d y = normal.cross(right);
  if (y.norm() < 0.05) return std::nullopt;
  Eigen::Matrix3d rotation;
  rotation << y.normalized().cross(normal), y.normalized(), normal;
  return rotation;
}

}  // namespace

MirrorReach::MirrorReach(const CameraModel& camera, const Rigid3& cam_from_world, const MirrorTarget& target,
                         const MirrorReachOptions& options)
    : camera_(camera),
      cam_from_world_(cam_from_world),
      camera_in_world_(cam_from_world.inverse().translation),
      opening_m_(target.opening_m),
      half_size_m_(0.5 * target.opening_m),
      options_(options) {
  constexpr double with_border = 0.625;  // of a tag's edge: half of its 8 cells and one of white
  for (const PlanarTag& tag : target.tags) {
    tag_centres_m_.push_back(tag.centre_m);
    half_size_m_ =
        half_size_m_.cwiseMax((tag.centre_m.cwiseAbs().array() + with_border * tag.size_m + options_.frame_m).matrix());
  }
}

// Of the middle, so that the lowest corner clears the plane.
double MirrorReach::height_for(const Eigen::Matrix3d& rotation) const {
  return options_.clearance_m + std::abs(rotation(2, 0)) * half_size_m_.x() +
         std::abs(rotation(2, 1)) * half_size_m_.y();
}

double MirrorReach::above_plane_m(const Rigid3& world_from_mirror) const {
  const Eigen::Matrix3d rotation = world_from_mirror.rotation.toRotationMatrix();
  return world_from_mirror.translation.z() - height_for(rotation) + options_.clearance_m;
}

bool MirrorReach::in_picture(const Vector3d& x_in_world, double margin) const {
  const Vector3d in_cam = cam_from_world_ * x_in_world;
  if (!(in_cam.z() > 0)) return false;
  const Eigen::Vector2d pixel = camera_.project(in_cam);
  const Eigen::Vector2d at(pixel.x() / camera_.width, pixel.y() / camera_.height);
  return at.minCoeff() >= margin && at.maxCoeff() <= 1 - margin;
}

bool MirrorReach::sees(const Rigid3& world_from_mirror, double margin) const {
  const Vector3d& centre = world_from_mirror.translation;
  const Vector3d normal = world_from_mirror.rotation * Vector3d::UnitZ();
  if (normal.dot((camera_in_world_ - centre).normalized()) < options_.least_facing) return false;
  if (!in_picture(centre, margin)) return false;
  std::size_t tags = 0;
  for (const Eigen::Vector2d& tag : tag_centres_m_)
    tags += in_picture(world_from_mirror * Vector3d(tag.x(), tag.y(), 0), margin) ? 1 : 0;
  return static_cast<double>(tags) >= options_.least_tags * static_cast<double>(tag_centres_m_.size());
}

std::optional<Rigid3> MirrorReach::showing(const Vector3d& p, const Vector3d& direction, const Vector3d& right) const {
  if (!(direction.z() > 0)) return std::nullopt;
  // How far along the ray depends on the tilt (it must clear the plane) and the tilt on that: a few rounds settle it.
  Vector3d hit = p + 0.15 * direction;
  double height = 0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 5; ++i) {
    const std::optional<Eigen::Matrix3d> turned =
        facing((direction + (camera_in_world_ - hit).normalized()).normalized(), right);
    if (!turned) return std::nullopt;
    rotation = *turned;
    height = height_for(rotation);
    constexpr int last = 4;  // the tilt fits the place exactly
    if (i < last) hit = p + std::min(height / direction.z(), options_.farthest_m) * direction;
  }
  // A low direction's ray meets the mirror below its middle, if it still meets the opening.
  Vector3d centre = hit;
  if (hit.z() < height) {
    const Vector3d normal = rotation.col(2);
    const Vector3d uphill = Vector3d::UnitZ() - normal.z() * normal;  // in the mirror; its height is its length squared
    if (!(uphill.squaredNorm() > 0.01)) return std::nullopt;
    centre += (height - hit.z()) / uphill.squaredNorm() * uphill;
  }
  const Eigen::Vector2d at = (rotation.transpose() * (hit - centre)).head<2>();
  constexpr double inside = 0.45;  // of the opening's edge from the middle: not on the rim
  if ((at.cwiseAbs().array() > inside * opening_m_.array()).any()) return std::nullopt;
  const Rigid3 pose{Eigen::Quaterniond(rotation), centre};
  return allows(pose) && in_picture(hit, options_.picture_margin) ? std::optional(pose) : std::nullopt;
}

Vector3d virtual_centre(const Vector3d& camera_in_world, const Rigid3& world_from_mirror) {
  const Vector3d normal = world_from_mirror.rotation * Vector3d::UnitZ();
  return camera_in_world - 2 * normal.dot(camera_in_world - world_from_mirror.translation) * normal;
}

}  // namespace mf
