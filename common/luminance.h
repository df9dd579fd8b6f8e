// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace mf {

// Of linear BT.709 primaries, in their unit; of encoded values it is the luma (ITU-R BT.709-6, item 3.2).
[[nodiscard]] inline float luminance_of(const Eigen::Vector3f& rgb) {
  return 0.2126F * rgb.x() + 0.7152F * rgb.y() + 0.0722F * rgb.z();
}

}  // namespace mf
