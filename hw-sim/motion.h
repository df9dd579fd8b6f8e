// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/rigid3.h"

namespace mf::sim {

struct MotionInput {
  Eigen::Vector3d camera_in_world;
  Eigen::Vector3d lamp_in_world;
  Eigen::Vector2d plate_half_size_m;
};

// world_from_mirror, frame by frame, as a person would wave the mirror over the table about the world origin: three
// fifths of the frames wind down the hemisphere of directions in a spiral, two fifths sweep the lamp's reflection over
// the table in rows. In every frame the mirror faces halfway between its direction and the camera and clears the table.
[[nodiscard]] std::vector<Rigid3> wave_mirror(const MotionInput&, int frames, std::uint64_t seed);

// The pose of a mirror that shows the camera what arrives at the table point `p` from `direction` (unit length, towards
// the light), 2 cm above the table or more.
[[nodiscard]] Rigid3 mirror_pose(const MotionInput&, const Eigen::Vector3d& p, const Eigen::Vector3d& direction,
                                 double roll_rad);

}  // namespace mf::sim
