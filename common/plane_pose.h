// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/homography.h"
#include "common/rigid3.h"

namespace mf {

// The pose moved by a small rotation ω about the target's origin and a shift τ, both along the camera's axes:
//   x_in_cam = exp(ω) R x + t + τ.
[[nodiscard]] Rigid3 moved(const Rigid3& cam_from_target, const Eigen::Matrix<double, 6, 1>& rotation_and_shift);

// Pose from the homography of a plane of the target, z = const (Zhang 2000, §3.1), into the camera's picture whose K is
// `k_matrix`, or the identity for normalized image coordinates. `point_in_target` lies in that plane and was seen: it
// fixes the side of the camera. A start for a refinement, for it minimizes no error in the picture.
[[nodiscard]] std::optional<Rigid3> pose_from_homography(const Homography& picture_from_plane,
                                                         const Eigen::Vector3d& point_in_target,
                                                         const Eigen::Matrix3d& k_matrix);

// The same place, tilted the other way: the plane's normal mirrored at the line of sight to `centre_in_target`. A small
// or distant plane fits almost as well like this (Schweighofer & Pinz 2006).
[[nodiscard]] Rigid3 mirrored_tilt(const Rigid3& cam_from_target, const Eigen::Vector3d& centre_in_target);

}  // namespace mf
