// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>

#include "common/mirror_target.h"
#include "host/calibration/calibrate.h"

namespace mf::testing {

// A frame of tags around an opening of 34 × 26 cm: ten along the long sides, six between on the short ones.
[[nodiscard]] MirrorTarget framed_mirror();

[[nodiscard]] CameraModel ordinary_camera();  // 768 × 640, f about 1000, no distortion

// The camera before the reflecting side, `distance_m` away, the mirror tilted about an axis in its plane.
[[nodiscard]] Rigid3 facing_pose(double distance_m, double tilt_rad, double axis_rad, const Eigen::Vector2d& offset_m);

// What the camera sees of the target's tags with Gaussian noise; tags that leave the picture are left out.
[[nodiscard]] TargetView seen(const CameraModel&, const MirrorTarget&, const Rigid3& cam_from_mirror, double sigma_px,
                              std::mt19937& random);

struct SyntheticCapture {
  CameraModel camera;
  std::vector<Rigid3> cam_from_mirror;
  Rigid3 cam_from_world;
  CalibrationInput input;
};
// Poses at 0.8 to 1.3 m, tilted 10 to 50 degrees about every axis.
[[nodiscard]] SyntheticCapture synthetic_capture(const CameraModel&, int frames, double sigma_px, unsigned seed);

}  // namespace mf::testing
