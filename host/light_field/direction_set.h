// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace mf {

// The directions of an incident light field: the vertices of a frequency-subdivided icosahedron (a geodesic sphere)
// whose cells reach above the plane. Ihrke et al. 2008, §4.3.
//
// Plane frame: z is the plane's normal; a direction points from the plane towards the light, unit length, z > 0.
// The cells are the spherical Voronoi cells of the geodesic vertices, cut off at the horizon: they tile the hemisphere,
// so the solid angles sum to 2π. A cell that the horizon cuts is represented by the centroid of what is left.
struct DirectionSet {
  int frequency = 0;  // subdivisions of an icosahedron's edge
  std::vector<Eigen::Vector3f> directions;
  std::vector<float> solid_angles_sr;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // over the directions, for interpolation
  // Corners of cell i, unit vectors counter-clockwise seen from outside: cell_corners[cell_begin[i] … cell_begin[i +
  // 1]).
  std::vector<Eigen::Vector3f> cell_corners;
  std::vector<std::uint32_t> cell_begin;

  [[nodiscard]] std::size_t size() const { return directions.size(); }
  [[nodiscard]] std::span<const Eigen::Vector3f> cell(std::size_t i) const {
    return {cell_corners.data() + cell_begin[i], cell_corners.data() + cell_begin[i + 1]};
  }
};

// The smallest set of at least `count` directions (sizes go by 5 f² and a rim). Precondition: count ≥ 1.
[[nodiscard]] DirectionSet geodesic_hemisphere(int count);
[[nodiscard]] DirectionSet geodesic_hemisphere_of_frequency(int frequency);

// A part of a cell: the direction of its centroid, and its solid angle.
struct CellSample {
  Eigen::Vector3f direction;
  float solid_angle_sr = 0;
};
// Cuts cell i into parts of about the same shape that tile it: triangles of a fan about its direction, each split
// `splits` times in two across its longest edge (so about 6 · 2^splits parts).
[[nodiscard]] std::vector<CellSample> split_cell(const DirectionSet&, std::size_t i, int splits);
// The same with directions in the world.
[[nodiscard]] std::vector<CellSample> split_cell(const DirectionSet&, std::size_t i, int splits,
                                                 const Eigen::Matrix3f& world_from_plane);

// Where a direction falls among its neighbours: barycentric weights over three directions (sum 1, none negative).
struct DirectionWeights {
  std::array<std::uint32_t, 3> index{};
  std::array<float, 3> weight{};
};

// Finds them in constant time. A direction beyond the rim of the set gets the nearest point of the rim.
class DirectionLocator {
 public:
  // Keeps a reference: the set outlives the locator.
  explicit DirectionLocator(const DirectionSet&);
  [[nodiscard]] DirectionWeights locate(const Eigen::Vector3f& direction) const;

 private:
  const DirectionSet* set_;
  int grid_ = 0;
  std::vector<std::vector<std::uint32_t>> triangles_in_cell_;  // by cell of the hemisphere's equal-area square
};

}  // namespace mf
