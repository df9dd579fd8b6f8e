// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace mf {

// Light that the lens loses towards the picture's corners:  gain(r) = 1 + a r² + b r⁴ + c r⁶,  measured = gain · true.
// r is the distance from `centre_px` divided by `radius_px` (half the picture's diagonal, so that r ≤ 1 about).
struct Vignetting {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 1;                                    // > 0
  Eigen::Vector3d coefficients = Eigen::Vector3d::Zero();  // a, b, c; zero: no vignetting

  [[nodiscard]] double gain(double x_px, double y_px) const {
    const double r2 = (Eigen::Vector2d(x_px, y_px) - centre_px).squaredNorm() / (radius_px * radius_px);
    return 1 + r2 * (coefficients[0] + r2 * (coefficients[1] + r2 * coefficients[2]));
  }
  [[nodiscard]] bool is_identity() const { return coefficients.isZero(0); }
};

}  // namespace mf
