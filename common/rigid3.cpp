// SPDX-License-Identifier: Apache-2.0
#include "common/rigid3.h"

namespace mf {

std::optional<Rigid3> Rigid3::from_matrix(const Eigen::Matrix4d& target_from_source) {
  constexpr double tolerance = 1e-4;  // what five printed digits leave of a rotation
  const Eigen::Matrix3d r = target_from_source.topLeftCorner<3, 3>();
  if (!target_from_source.allFinite()) return std::nullopt;
  if (!(r.transpose() * r).isIdentity(tolerance) || r.determinant() < 0) return std::nullopt;
  if ((target_from_source.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > tolerance) return std::nullopt;
  return Rigid3{Eigen::Quaterniond(r).normalized(), target_from_source.topRightCorner<3, 1>()};
}

Eigen::Matrix4d Rigid3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

double rotation_angle_between(const Rigid3& a, const Rigid3& b) {
  return a.rotation.angularDistance(b.rotation);
}

}  // namespace mf
