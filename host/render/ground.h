// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/io/mesh.h"
#include "host/light_field/light_tiles.h"

namespace mf {

// What the receiving plane (z = 0 in the plane frame) sends up around the object: outgoing radiance.
using GroundRadiance = PlaneTile;

// The part of the plane that matters to an object and to which it matters: a square about its bounding sphere, black.
// Five radii to each side: a patch of the object sees 95 % of its light from below within (cosine-weighted, at the
// height of one radius); beyond, the rim's value holds on.
[[nodiscard]] inline GroundRadiance ground_around(const Bounds& object, int texels_a_side) {
  const Eigen::Vector2f centre = object.centre.head<2>();
  const Eigen::Vector2f half = Eigen::Vector2f::Constant(5 * object.radius);
  const auto count = static_cast<std::size_t>(texels_a_side) * static_cast<std::size_t>(texels_a_side);
  return {centre - half, centre + half, texels_a_side, texels_a_side,
          std::vector<Eigen::Vector4f>(count, Eigen::Vector4f::Zero())};
}

}  // namespace mf
