// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/io/mesh.h"
#include "host/lumigraph/posed_photo.h"

namespace mf {

struct HullOptions {
  int resolution = 128;  // cells along the longest side of the shape's box, 8 to 512: cells are cubes
  // World corners of the box that holds the shape; nothing: found. Needed where the photos alone do not close it.
  std::optional<std::array<Eigen::Vector3d, 2>> box;

  [[nodiscard]] std::optional<std::string> validate() const;
};

// The visual hull (Laurentini 1994): the largest shape with the silhouettes that the photos' masks show (0: background,
// 255: the shape, 128 its outline). Closed, normals outwards.
//
// A point is in it when every photo that has it in its picture shows it inside of the silhouette, and two photos at
// least have it. Each photo gives the signed distance to its outline, in pixels times depth / focal length: about
// metres; the hull's field is the least of them, and its zero surface is drawn by marching tetrahedra. A photo without
// a mask says nothing. Throws InputError: fewer than two photos with a mask; no point in all silhouettes; silhouettes
// that do not close the shape.
[[nodiscard]] TriangleMesh visual_hull(const PhotoSet&, const HullOptions&);

// Signed distance to a mask's outline at each pixel's centre, pixels: above 0 inside. Straight distances, exact within
// what an outline between pixel centres leaves open.
[[nodiscard]] ImageF signed_distance(const ImageU8& mask);

// Masks for photos without one, from pictures before a dark background: a pixel whose largest channel is above
// `threshold` (a code, or linear) is the shape.
void mask_dark_background(PhotoSet&, float threshold);

}  // namespace mf
