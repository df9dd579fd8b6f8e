// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "host/light_field/light_field.h"

namespace mf::test {

// A field over 0.4 × 0.4 m at z = 0.1 whose light can be told by its place: red light comes from within 20° of
// (0.6, 0, 0.8) and doubles from the left edge to the right; the rest is dim and blue. The surroundings are a sphere of
// 2 m about the plane's middle.
inline LightField lamp_field() {
  LightField field;
  field.plane = {{Eigen::Quaterniond::Identity(), {0, 0, 0.1}}, {-0.2, -0.2}, {0.2, 0.2}};
  field.directions = geodesic_hemisphere(500);
  field.surroundings = sphere_surroundings({0, 0, 0.1F}, 2);
  field.resolution = 8;
  field.options_json = "{}";
  const Eigen::Vector3f lamp(0.6F, 0, 0.8F);
  for (const Eigen::Vector3f& direction : field.directions.directions)
    for (int texel = 0; texel < 64; ++texel) {
      const float along = 1 + static_cast<float>(texel % 8) / 7;  // 1 in the first column, 2 in the last
      const bool lit = direction.dot(lamp) > std::cos(0.35F);
      field.rgbc.push_back(lit ? Eigen::Vector4f(4 * along, 0, 0, 1) : Eigen::Vector4f(0, 0, 0.25F, 1));
    }
  return field;
}

}  // namespace mf::test
