// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

namespace mf {

// A projective map of the plane: x_in_target ~ H · (x, y, 1).
struct Homography {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();

  // Precondition: the point is not on the line that maps to infinity.
  [[nodiscard]] Eigen::Vector2d operator*(const Eigen::Vector2d& x_in_source) const {
    return (matrix * x_in_source.homogeneous()).hnormalized();
  }
  [[nodiscard]] Homography inverse() const;
};

// Least squares in the algebraic sense after Hartley's normalization (Hartley & Zisserman 2004, alg. 4.2).
// Nothing for fewer than four points or points that leave it undetermined (three of four on a line).
[[nodiscard]] std::optional<Homography> fit_homography(std::span<const Eigen::Vector2d> source,
                                                       std::span<const Eigen::Vector2d> target);

}  // namespace mf
