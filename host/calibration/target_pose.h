// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/camera_model.h"
#include "common/plane_pose.h"
#include "common/rigid3.h"
#include "host/calibration/target_view.h"

namespace mf {

// How a corner's pixel moves with the camera's parameters and with the pose. The pose moves by a small rotation ω and
// a shift τ as moved() applies them.
struct CornerDerivative {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, CameraModel::parameter_count> by_camera;
  Eigen::Matrix<double, 2, 6> by_pose;  // ω, τ
};
// Nothing when the point is not in front of the camera.
[[nodiscard]] std::optional<CornerDerivative> corner_derivative(const CameraModel&, const Rigid3& cam_from_target,
                                                                const Eigen::Vector3d& x_in_target);

// Half the robust sum of squares that calibration minimizes: Σ ρ(rᵀ Λ r) over inlier tags, r the eight corner errors
// of a tag, Λ its information and ρ Huber's.
[[nodiscard]] double pose_cost(const CameraModel&, const Rigid3& cam_from_target, const TargetView&);

// Every residual beyond this many standard deviations of a tag's eight is damped: χ²(8) exceeds its square once in
// a thousand.
inline constexpr double tag_huber_width = 5.1;

struct PoseEstimate {
  Rigid3 cam_from_target;
  double cost = 0;
  // A small or distant plane fits almost as well when it is tilted the other way (Schweighofer & Pinz 2006). Cost of
  // the best such pose; infinite when there is none.
  double mirrored_cost = 0;
};

// Minimizes pose_cost() by Levenberg–Marquardt from `start` and from its mirrored tilt; the better one wins.
// Nothing when neither converges with the target in front of the camera.
[[nodiscard]] std::optional<PoseEstimate> estimate_pose(const CameraModel&, const TargetView&, const Rigid3& start);

}  // namespace mf
