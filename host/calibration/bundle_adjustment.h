// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/rigid3.h"
#include "host/calibration/target_view.h"

namespace mf {

struct AdjustmentOptions {
  // Distortion terms that are estimated, k1 k2 p1 p2 k3; the others keep the value they have.
  std::array<bool, 5> free_distortion{true, true, true, true, false};
  // Standard deviation, about 0, of what a lens is expected to do before any picture is seen: it keeps a term that the
  // views do not show from drifting and taking the principal point with it. All > 0.
  std::array<double, 5> distortion_prior{0.5, 0.5, 0.01, 0.01, 0.5};
  bool square_pixels = false;  // fx = fy
  int threads = 2;             // ≥ 1
  int max_iterations = 50;
};

struct AdjustedPose {
  Rigid3 cam_from_target;
  Eigen::Matrix<double, 6, 6> covariance;  // of (ω, τ), see CornerDerivative: radians, metres
};

struct Adjustment {
  CameraModel camera;
  Eigen::Matrix<double, CameraModel::parameter_count, CameraModel::parameter_count> camera_covariance;  // 0: held
  std::vector<AdjustedPose> poses;                                                                      // one a view
  bool converged = false;
};

// Camera and all poses together, minimizing Σ pose_cost() (Huber's loss a tag) plus the priors, with Ceres: the poses
// are eliminated first (Schur), so time is linear in the views. Outlier tags don't count.
// Preconditions: as many poses as views; every inlier corner in front of the camera; a view has at least one inlier.
[[nodiscard]] Adjustment adjust_bundle(const CameraModel& start, const std::vector<TargetView>&,
                                       const std::vector<Rigid3>& cam_from_target, const AdjustmentOptions&);

// Only one pose, with the covariance that follows from the tags and from `adjustment`'s camera.
[[nodiscard]] AdjustedPose pose_with_covariance(const Adjustment&, const TargetView&, const Rigid3& cam_from_target);

}  // namespace mf
