// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

namespace mf {

// A proper rigid transform, metres:  x_in_target = rotation · x_in_source + translation.
//
// Named target_from_source everywhere, so that products read: a_from_c = a_from_b * b_from_c.
// A reflection (det −1) is no Rigid3: see VirtualView.
struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // unit length
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  // Nothing unless the upper 3×3 is a rotation (RᵀR = 1 within 1e-4, det +1) and the last row is 0 0 0 1.
  [[nodiscard]] static std::optional<Rigid3> from_matrix(const Eigen::Matrix4d& target_from_source);

  [[nodiscard]] Eigen::Matrix4d matrix() const;

  [[nodiscard]] Rigid3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation)};
  }
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& x_in_source) const {
    return rotation * x_in_source + translation;
  }
  [[nodiscard]] Rigid3 operator*(const Rigid3& source_from_other) const {
    return {(rotation * source_from_other.rotation).normalized(), *this * source_from_other.translation};
  }
};

// Angle of the rotation between two frames, radians, in [0, π].
[[nodiscard]] double rotation_angle_between(const Rigid3& a, const Rigid3& b);

}  // namespace mf
