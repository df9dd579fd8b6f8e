// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "common/rigid3.h"

namespace mf {

// A camera that a hand moves. Camera axes x right, y down, z forward; lengths in the world's unit.
//
// `focus_distance` lies along the camera's z: there is the pivot of orbiting, and there stands the plane on which a
// lumigraph is focused. Turning keeps the picture's tilt against `up_in_world`: an upright camera stays upright.
// Each movement is a function from one state to the next; angles are radians.
struct Navigation {
  Rigid3 world_from_cam;
  Eigen::Vector3d up_in_world = Eigen::Vector3d::UnitZ();  // unit
  double focus_distance = 1;                               // > 0

  [[nodiscard]] Eigen::Vector3d pivot_in_world() const {
    return world_from_cam * Eigen::Vector3d(0, 0, focus_distance);
  }
};

// How near the line of sight may come to straight up or down, radians: beyond, left and right would swap.
constexpr double closest_to_the_pole_rad = 0.03;

// About the pivot, which stays in the picture's middle: the camera goes `right` about the upright axis and `up` towards
// it, as far as the pole allows.
[[nodiscard]] Navigation orbited(const Navigation&, double right_rad, double up_rad);

// In place: the line of sight turns right and up.
[[nodiscard]] Navigation turned(const Navigation&, double right_rad, double up_rad);

// Along the camera's axes, in the world's unit; the pivot goes along.
[[nodiscard]] Navigation moved(const Navigation&, const Eigen::Vector3d& step_in_cam);

// Towards the pivot (factor below 1) or away from it: the focus distance is multiplied by `factor` > 0.
[[nodiscard]] Navigation dollied(const Navigation&, double factor);

// The camera stays; the pivot, and with it the plane of focus, goes to `factor` > 0 times its distance.
[[nodiscard]] Navigation refocused(const Navigation&, double factor);

// At another camera's place, looking where it looks, tilted as it is; the focus keeps its distance.
[[nodiscard]] Navigation jumped(const Navigation&, const Rigid3& world_from_cam);

}  // namespace mf
