// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/marching_tetrahedra.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <unordered_map>

#include "common/check.h"

namespace mf {

namespace {

struct Corner {
  int x = 0, y = 0, z = 0;
};

// The six paths along the axes from a cube's first corner to the opposite one: their four corners are tetrahedra of
// positive volume when the axes' order is an even permutation.
struct Path {
  std::array<int, 3> axes;
  bool even;
};
constexpr std::array<Path, 6> paths{{{{0, 1, 2}, true},
                                     {{1, 2, 0}, true},
                                     {{2, 0, 1}, true},
                                     {{0, 2, 1}, false},
                                     {{2, 1, 0}, false},
                                     {{1, 0, 2}, false}}};

class SurfaceBuilder {
 public:
  explicit SurfaceBuilder(const ScalarGrid& grid) : grid_(grid) {}

  void add_cube(int x, int y, int z) {
    for (const Path& path : paths) {
      std::array<Corner, 4> corners{Corner{x, y, z}};
      for (std::size_t i = 0; i < 3; ++i) {
        corners[i + 1] = corners[i];
        step(corners[i + 1], path.axes[i]);
      }
      if (!path.even) std::swap(corners[2], corners[3]);
      add_tetrahedron(corners);
    }
  }

  [[nodiscard]] TriangleMesh finished() {
    mesh_.normals.assign(mesh_.positions.size(), Eigen::Vector3f::Zero());
    for (const auto& [a, b, c] : mesh_.triangles) {
      const Eigen::Vector3f& p = mesh_.positions[a];
      const Eigen::Vector3f n = (mesh_.positions[b] - p).cross(mesh_.positions[c] - p);
      for (const std::uint32_t vertex : {a, b, c}) mesh_.normals[vertex] += n;
    }
    for (Eigen::Vector3f& n : mesh_.normals)
      n = n.norm() > 0 ? Eigen::Vector3f(n.normalized()) : Eigen::Vector3f::UnitZ();
    mesh_.albedo.assign(mesh_.positions.size(), Eigen::Vector3f::Constant(default_albedo));
    return std::move(mesh_);
  }

 private:
  static void step(Corner& corner, int axis) {
    if (axis == 0) ++corner.x;
    if (axis == 1) ++corner.y;
    if (axis == 2) ++corner.z;
  }
  [[nodiscard]] std::size_t index(const Corner& c) const { return grid_.index(c.x, c.y, c.z); }
  [[nodiscard]] float value(const Corner& c) const { return grid_.values[index(c)]; }
  [[nodiscard]] bool inside(const Corner& c) const { return value(c) > 0; }

  // Precondition: positive volume, det(c1 − c0, c2 − c0, c3 − c0) > 0. Even permutations of the corners keep it.
  void add_tetrahedron(std::array<Corner, 4> c) {
    const auto in = std::count_if(c.begin(), c.end(), [this](const Corner& corner) { return inside(corner); });
    if (in == 0 || in == 4) return;
    if (in == 2) {
      add_quadrangle(c);
      return;
    }
    // The lone corner to the front, by an even permutation.
    const bool lone_inside = in == 1;
    std::size_t lone = 0;
    while (inside(c[lone]) != lone_inside) ++lone;
    if (lone != 0) {
      std::swap(c[0], c[lone]);
      std::swap(c[lone == 1 ? 2 : 1], c[lone == 3 ? 2 : 3]);
    }
    const std::uint32_t a = vertex(c[0], c[1]);
    const std::uint32_t b = vertex(c[0], c[2]);
    const std::uint32_t d = vertex(c[0], c[3]);
    if (lone_inside)
      mesh_.triangles.push_back({a, b, d});
    else
      mesh_.triangles.push_back({a, d, b});
  }

  void add_quadrangle(std::array<Corner, 4> c) {
    // The two inner corners to the front, by an even permutation.
    std::size_t first = 0;
    while (!inside(c[first])) ++first;
    std::size_t second = first + 1;
    while (!inside(c[second])) ++second;
    std::size_t third = 0;
    while (third == first || third == second) ++third;
    const std::size_t fourth = 6 - first - second - third;
    std::array<std::size_t, 4> order{first, second, third, fourth};
    int inversions = 0;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = i + 1; j < 4; ++j) inversions += order[i] > order[j] ? 1 : 0;
    if (inversions % 2 == 1) std::swap(order[2], order[3]);
    const auto cut = [&](std::size_t i, std::size_t j) { return vertex(c[order[i]], c[order[j]]); };
    const std::array<std::uint32_t, 4> q{cut(0, 2), cut(0, 3), cut(1, 3), cut(1, 2)};
    mesh_.triangles.push_back({q[0], q[1], q[2]});
    mesh_.triangles.push_back({q[0], q[2], q[3]});
  }

  // Where the field is zero between an inner and an outer corner.
  std::uint32_t vertex(const Corner& one, const Corner& other) {
    const std::size_t a = std::min(index(one), index(other));
    const std::size_t b = std::max(index(one), index(other));
    // An edge goes one step up to three axes: the difference of the indices tells which.
    const auto [at, is_new] = vertices_.try_emplace(a * 8 + direction(b - a), 0);
    if (!is_new) return at->second;
    at->second = static_cast<std::uint32_t>(mesh_.positions.size());
    constexpr float least = 1e-3F;  // of the edge, from its ends: no triangle shrinks to a line
    const float t = std::clamp(value(one) / (value(one) - value(other)), least, 1 - least);
    const Eigen::Vector3d p = grid_.position(one.x, one.y, one.z);
    const Eigen::Vector3d q = grid_.position(other.x, other.y, other.z);
    mesh_.positions.push_back((p + static_cast<double>(t) * (q - p)).cast<float>());
    return at->second;
  }

  [[nodiscard]] std::size_t direction(std::size_t difference) const {
    const auto row = static_cast<std::size_t>(grid_.corners[0]);
    const std::size_t layer = row * static_cast<std::size_t>(grid_.corners[1]);
    const std::size_t z = difference >= layer ? 1 : 0;
    const std::size_t y = difference - z * layer >= row ? 1 : 0;
    return (difference - z * layer - y * row) + 2 * y + 4 * z;
  }

  const ScalarGrid& grid_;
  TriangleMesh mesh_;
  std::unordered_map<std::size_t, std::uint32_t> vertices_;
};

}  // namespace

TriangleMesh zero_surface(const ScalarGrid& grid) {
  check(grid.corners[0] >= 2 && grid.corners[1] >= 2 && grid.corners[2] >= 2, "a grid has a cube");
  check(grid.values.size() == grid.index(0, 0, grid.corners[2]), "a grid has a value for each corner");
  SurfaceBuilder builder(grid);
  for (int z = 0; z + 1 < grid.corners[2]; ++z)
    for (int y = 0; y + 1 < grid.corners[1]; ++y)
      for (int x = 0; x + 1 < grid.corners[0]; ++x) builder.add_cube(x, y, z);
  return builder.finished();
}

}  // namespace mf
