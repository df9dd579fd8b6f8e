// SPDX-License-Identifier: Apache-2.0
#include "common/plane_pose.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "common/dense.h"

namespace mf {

Rigid3 moved(const Rigid3& pose, const Eigen::Matrix<double, 6, 1>& step) {
  const Eigen::Vector3d omega = step.head<3>();
  const double angle = omega.norm();
  const Eigen::Quaterniond turn =
      angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, omega / angle)) : Eigen::Quaterniond::Identity();
  return {(turn * pose.rotation).normalized(), pose.translation + step.tail<3>()};
}

std::optional<Rigid3> pose_from_homography(const Homography& picture_from_plane, const Eigen::Vector3d& point_in_target,
                                           const Eigen::Matrix3d& k_matrix) {
  Eigen::Matrix3d m = k_matrix.inverse() * picture_from_plane.matrix;
  const double scale = std::sqrt(m.col(0).norm() * m.col(1).norm());
  if (!(scale > 0) || !m.allFinite()) return std::nullopt;
  const bool behind = m.row(2).dot(point_in_target.head<2>().homogeneous()) < 0;
  m /= behind ? -scale : scale;
  Eigen::Matrix3d r;
  r << m.col(0), m.col(1), m.col(0).cross(m.col(1));
  r = nearest_rotation(r);
  return Rigid3{Eigen::Quaterniond(r), m.col(2) - point_in_target.z() * r.col(2)};
}

Rigid3 mirrored_tilt(const Rigid3& pose, const Eigen::Vector3d& centre_in_target) {
  const Eigen::Vector3d centre = pose * centre_in_target;
  const Eigen::Vector3d sight = centre.normalized();
  const Eigen::Vector3d normal = pose.rotation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = normal.cross(sight);
  const double sine = axis.norm();
  Rigid3 out = pose;
  if (sine > 0)  // from the normal to the line of sight, and as far again
    out.rotation = Eigen::AngleAxisd(2 * std::atan2(sine, normal.dot(sight)), axis / sine) * pose.rotation;
  out.rotation.normalize();
  out.translation = centre - out.rotation * centre_in_target;
  return out;
}

}  // namespace mf
