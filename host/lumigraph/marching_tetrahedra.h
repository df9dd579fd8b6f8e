// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "host/io/mesh.h"

namespace mf {

// A scalar field on the corners of a grid of cubes; x runs fastest.
struct ScalarGrid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // of corner (0, 0, 0)
  double spacing = 1;
  std::array<int, 3> corners{};  // each way
  std::vector<float> values;

  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(corners[0]) *
               (static_cast<std::size_t>(y) + static_cast<std::size_t>(corners[1]) * static_cast<std::size_t>(z));
  }
  [[nodiscard]] Eigen::Vector3d position(int x, int y, int z) const {
    return origin + spacing * Eigen::Vector3d(x, y, z);
  }
};

// The surface where the field is zero, its positive side inside. Each cube is cut into six tetrahedra about one
// diagonal (Kuhn 1960): neighbours cut their common face alike, so that the surface has no crack and no ambiguous case,
// unlike marching cubes (Doi, Koide 1991). Vertices are shared; normals are the triangles', weighted by area.
// Precondition: the field is negative on the grid's border, so that the surface is closed.
[[nodiscard]] TriangleMesh zero_surface(const ScalarGrid&);

}  // namespace mf
