// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace mf {

// Pinhole camera with Brown–Conrady distortion (Brown 1966; the order of OpenCV and COLMAP's FULL/OPENCV models).
//
//   x = X/Z, y = Y/Z, r² = x² + y²
//   x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
//   y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
//   u = fx x' + cx,  v = fy y' + cy
//
// Camera axes: x right, y down, z forward. Pixel centres are at +0.5: the first pixel covers [0, 1] × [0, 1].
struct CameraModel {
  static constexpr int parameter_count = 9;
  using Parameters = std::array<double, parameter_count>;  // fx fy cx cy k1 k2 p1 p2 k3

  int width = 0;  // pixels
  int height = 0;
  Parameters parameters{1, 1, 0, 0, 0, 0, 0, 0, 0};

  [[nodiscard]] double fx() const { return parameters[0]; }
  [[nodiscard]] double fy() const { return parameters[1]; }
  [[nodiscard]] double cx() const { return parameters[2]; }
  [[nodiscard]] double cy() const { return parameters[3]; }
  [[nodiscard]] bool has_distortion() const;
  [[nodiscard]] Eigen::Matrix3d k_matrix() const;

  // Pixels of a point in the camera frame. Precondition: z > 0.
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& x_in_cam) const;

  // The ray (x/z, y/z, 1) through a pixel position. Nothing where the distortion has no inverse near the pixel.
  [[nodiscard]] std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const;
};

// The distortion alone, on normalized image coordinates. T is double or a Ceres Jet; d = k1 k2 p1 p2 k3.
template <typename T>
Eigen::Matrix<T, 2, 1> distort(const T* d, const T& x, const T& y) {
  const T r2 = x * x + y * y;
  const T radial = T(1) + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  return {x * radial + T(2) * d[2] * x * y + d[3] * (r2 + T(2) * x * x),
          y * radial + d[2] * (r2 + T(2) * y * y) + T(2) * d[3] * x * y};
}

// The one projection that solvers, simulator and renderers share. `parameters` as in CameraModel. Precondition: z > 0.
template <typename T>
Eigen::Matrix<T, 2, 1> project_brown_conrady(const T* parameters, const Eigen::Matrix<T, 3, 1>& x_in_cam) {
  const Eigen::Matrix<T, 2, 1> d = distort(parameters + 4, T(x_in_cam[0] / x_in_cam[2]), T(x_in_cam[1] / x_in_cam[2]));
  return {parameters[0] * d[0] + parameters[2], parameters[1] * d[1] + parameters[3]};
}

}  // namespace mf
