// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/rigid3.h"

namespace mf {

// Triangles with what a diffuse material needs, in one frame, metres. Arrays by vertex have the same length.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;  // for shading, unit length, out of the surface
  std::vector<Eigen::Vector3f> albedo;   // red, green, blue, 0 to 1: the base colour of the vertex' part of the file
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

struct MeshOptions {
  std::optional<double> albedo;  // replaces every base colour of the file; 0 to 1

  [[nodiscard]] std::optional<std::string> validate() const;
};

// The base colour of a surface whose file names no material.
inline constexpr float default_albedo = 0.7F;

// Any format that assimp reads; OBJ and glTF 2.0 are tested. OBJ coordinates are taken as they are (world, Z-up); glTF
// is Y-up by its standard and is turned: (x, y, z) → (x, −z, y). Normals as in the file; without any, flat ones.
// Throws InputError naming the file: missing, unreadable, no triangle, a coordinate that is not finite.
[[nodiscard]] TriangleMesh read_mesh(const std::filesystem::path&, const MeshOptions& = {});

// Wavefront OBJ: positions, normals and triangles, coordinates as they are. Written aside and renamed.
void write_obj(const std::filesystem::path&, const TriangleMesh&);

[[nodiscard]] TriangleMesh transformed(const Rigid3& target_from_source, TriangleMesh);

// The axis-aligned box of every vertex, and a sphere about its centre that holds them too. Empty mesh: all zero.
struct Bounds {
  Eigen::Vector3f low = Eigen::Vector3f::Zero();
  Eigen::Vector3f high = Eigen::Vector3f::Zero();
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  float radius = 0;
};
[[nodiscard]] Bounds bounds_of(const TriangleMesh&);
[[nodiscard]] std::array<Eigen::Vector3f, 8> corners_of(const Bounds&);

}  // namespace mf
