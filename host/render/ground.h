// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/render/light_set.h"
#include "host/io/mesh.h"

namespace mf {

// What the receiving plane (z = 0 in the plane frame) sends up around the object: outgoing radiance, as PlaneImage.
struct GroundRadiance {
  Eigen::Vector2f min_m = Eigen::Vector2f::Zero();
  Eigen::Vector2f max_m = Eigen::Vector2f::Zero();
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector4f> texels;  // row 0 at max y; red, green, blue, unused

  [[nodiscard]] PlaneImage image() const { return {min_m, max_m, width, height, texels.data()}; }

  // Where the middle of a texel lies on the plane.
  [[nodiscard]] Eigen::Vector2f position(int column, int row) const {
    const Eigen::Vector2f size = max_m - min_m;
    return {min_m.x() + size.x() * (static_cast<float>(column) + 0.5F) / static_cast<float>(width),
            max_m.y() - size.y() * (static_cast<float>(row) + 0.5F) / static_cast<float>(height)};
  }
};

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
