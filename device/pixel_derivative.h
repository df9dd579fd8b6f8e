// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/camera_model.h"
#include "common/rigid3.h"

namespace mf {

// Where a target's point is seen, and how that moves with the pose (ω and τ of moved(), common/plane_pose.h).
struct PixelDerivative {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 6> by_pose;  // ω, τ
};

// ∂(distort(x, y)) / ∂(x, y) of common/camera_model.h. d = k1 k2 p1 p2 k3.
[[nodiscard]] inline Eigen::Matrix2d distortion_derivative(const double* d, double x, double y) {
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  const double slope = d[0] + r2 * (2 * d[1] + r2 * 3 * d[4]);  // of radial, by r²
  const double cross = 2 * (x * y * slope + d[2] * x + d[3] * y);
  return (Eigen::Matrix2d() << radial + 2 * x * x * slope + 2 * d[2] * y + 6 * d[3] * x, cross, cross,
          radial + 2 * y * y * slope + 6 * d[2] * y + 2 * d[3] * x)
      .finished();
}

// Nothing when the point is not in front of the camera.
[[nodiscard]] inline std::optional<PixelDerivative> pixel_derivative(const CameraModel& camera,
                                                                     const Rigid3& cam_from_target,
                                                                     const Eigen::Vector3d& x_in_target) {
  const Eigen::Vector3d turned = cam_from_target.rotation * x_in_target;
  const Eigen::Vector3d p = turned + cam_from_target.translation;
  if (!(p.z() > 0)) return std::nullopt;
  const double x = p.x() / p.z(), y = p.y() / p.z();
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << 1, 0, -x, 0, 1, -y;
  by_point = (distortion_derivative(camera.parameters.data() + 4, x, y) * by_point / p.z()).eval();
  by_point.row(0) *= camera.fx();
  by_point.row(1) *= camera.fy();
  PixelDerivative out;
  out.pixel = camera.project(p);
  for (int row = 0; row < 2; ++row)  // ∂p/∂ω · ω = ω × turned, so bᵀ(ω × t) = ωᵀ(t × b)
    out.by_pose.row(row).head<3>() = turned.cross(by_point.row(row).transpose()).transpose();
  out.by_pose.rightCols<3>() = by_point;
  return out;
}

}  // namespace mf
