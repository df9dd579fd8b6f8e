// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace mf {

// Where light is gathered, in the plane frame (z = 0 is the light field's plane), metres.
struct SurfacePoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  // for shading: interpolated, unit length
  Eigen::Vector3f geometric_normal =
      Eigen::Vector3f::UnitZ();  // the triangle's own, unit length, on the side that the camera sees
};

}  // namespace mf
