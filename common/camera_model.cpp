// SPDX-License-Identifier: Apache-2.0
#include "common/camera_model.h"

#include <Eigen/LU>
#include <algorithm>

namespace mf {

bool CameraModel::has_distortion() const {
  return std::any_of(parameters.begin() + 4, parameters.end(), [](double d) { return d != 0; });
}

Eigen::Matrix3d CameraModel::k_matrix() const {
  return (Eigen::Matrix3d() << fx(), 0, cx(), 0, fy(), cy(), 0, 0, 1).finished();
}

Eigen::Vector2d CameraModel::project(const Eigen::Vector3d& x_in_cam) const {
  return project_brown_conrady(parameters.data(), x_in_cam);
}

std::optional<Eigen::Vector3d> CameraModel::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d target((pixel.x() - cx()) / fx(), (pixel.y() - cy()) / fy());
  Eigen::Vector2d x = target;
  if (!has_distortion()) return Eigen::Vector3d(x.x(), x.y(), 1);
  // Newton with a numeric Jacobian: distortion is smooth and close to the identity, a few steps reach 1e-12.
  constexpr double step = 1e-6;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector2d at = distort(parameters.data() + 4, x.x(), x.y());
    const Eigen::Vector2d error = at - target;
    if (error.norm() < 1e-12) return Eigen::Vector3d(x.x(), x.y(), 1);
    Eigen::Matrix2d jacobian;
    jacobian.col(0) = (distort(parameters.data() + 4, x.x() + step, x.y()) - at) / step;
    jacobian.col(1) = (distort(parameters.data() + 4, x.x(), x.y() + step) - at) / step;
    if (jacobian.determinant() < 0.05) return std::nullopt;  // the model folds over here
    x -= jacobian.inverse() * error;
    if (!x.allFinite()) return std::nullopt;
  }
  if ((distort(parameters.data() + 4, x.x(), x.y()) - target).norm() > 1e-9) return std::nullopt;
  return Eigen::Vector3d(x.x(), x.y(), 1);
}

}  // namespace mf
