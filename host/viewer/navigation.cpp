// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/navigation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mf {

namespace {

// The line of sight, by its angle from `up_in_world` and the level direction (unit) above which it lies.
struct Sight {
  double from_pole_rad = 0;
  Eigen::Vector3d level;
};

Sight sight_of(const Navigation& n) {
  const Eigen::Vector3d forward = n.world_from_cam.rotation * Eigen::Vector3d::UnitZ();
  const double cosine = std::clamp(forward.dot(n.up_in_world), -1.0, 1.0);
  Eigen::Vector3d level = forward - cosine * n.up_in_world;
  // Straight up or down (a jump may lead there): the picture's edge tells what is ahead.
  if (level.norm() < 1e-9) level = n.world_from_cam.rotation * Eigen::Vector3d(0, cosine, 0);
  return {std::acos(cosine), level.normalized()};
}

Sight turned_sight(const Sight& sight, const Eigen::Vector3d& up, double right_rad, double up_rad) {
  const double lowest = std::numbers::pi - closest_to_the_pole_rad;
  return {std::clamp(sight.from_pole_rad - up_rad, closest_to_the_pole_rad, lowest),
          Eigen::AngleAxisd(-right_rad, up) * sight.level};
}

// The camera that looks there with a level horizon.
Eigen::Quaterniond upright(const Sight& sight, const Eigen::Vector3d& up) {
  Eigen::Matrix3d axes;
  axes.col(2) = std::sin(sight.from_pole_rad) * sight.level + std::cos(sight.from_pole_rad) * up;
  axes.col(0) = sight.level.cross(up);
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return Eigen::Quaterniond(axes).normalized();
}

}  // namespace

Navigation turned(const Navigation& n, double right_rad, double up_rad) {
  const Sight before = sight_of(n);
  const Eigen::Quaterniond tilt = upright(before, n.up_in_world).conjugate() * n.world_from_cam.rotation;
  Navigation next = n;
  next.world_from_cam.rotation =
      (upright(turned_sight(before, n.up_in_world, right_rad, up_rad), n.up_in_world) * tilt).normalized();
  return next;
}

Navigation orbited(const Navigation& n, double right_rad, double up_rad) {
  // To the right about the pivot is a sight that turns left; upwards is one that sinks.
  Navigation next = turned(n, -right_rad, -up_rad);
  next.world_from_cam.translation += n.pivot_in_world() - next.pivot_in_world();
  return next;
}

Navigation moved(const Navigation& n, const Eigen::Vector3d& step_in_cam) {
  Navigation next = n;
  next.world_from_cam.translation = n.world_from_cam * step_in_cam;
  return next;
}

Navigation dollied(const Navigation& n, double factor) {
  Navigation next = n;
  next.focus_distance = n.focus_distance * factor;
  next.world_from_cam.translation = n.world_from_cam * Eigen::Vector3d(0, 0, n.focus_distance - next.focus_distance);
  return next;
}

Navigation refocused(const Navigation& n, double factor) {
  Navigation next = n;
  next.focus_distance = n.focus_distance * factor;
  return next;
}

Navigation jumped(const Navigation& n, const Rigid3& world_from_cam) {
  Navigation next = n;
  next.world_from_cam = world_from_cam;
  return next;
}

}  // namespace mf
