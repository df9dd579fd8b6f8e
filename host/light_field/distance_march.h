// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "common/image.h"

namespace mf {

// 1 / distance from p to where a ray first meets the surface of `inverse_distance`, a map as Surroundings has it with
// more than one value; 0 when it meets none. `from_centre`: p − centre; `direction`: unit.
[[nodiscard]] float march_to_surface(const ImageF& inverse_distance, const Eigen::Vector3f& from_centre,
                                     const Eigen::Vector3f& direction);

}  // namespace mf
