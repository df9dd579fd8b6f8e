// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "host/light_field/light_field.h"

namespace mf {

// Radiance by position on the plane z = 0 (plane coordinates, metres): cell-centred texels over a rectangle, row 0 at
// max y. Red, green, blue and one unused. Bilinear; beyond the rectangle the rim's value holds on. The texels belong to
// somebody else.
struct PlaneImage {
  Eigen::Vector2f min_m = Eigen::Vector2f::Zero();
  Eigen::Vector2f max_m = Eigen::Vector2f::Zero();
  int width = 0;
  int height = 0;
  const Eigen::Vector4f* texels = nullptr;

  [[nodiscard]] std::size_t texel_count() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  // Where the middle of a texel lies on the plane.
  [[nodiscard]] Eigen::Vector2f position(int column, int row) const {
    const Eigen::Vector2f size = max_m - min_m;
    return {min_m.x() + size.x() * (static_cast<float>(column) + 0.5F) / static_cast<float>(width),
            max_m.y() - size.y() * (static_cast<float>(row) + 0.5F) / static_cast<float>(height)};
  }
};

// Bilinear lookup; see PlaneImage.
[[nodiscard]] Eigen::Vector4f sample(const PlaneImage& image, const Eigen::Vector2f& p);

// The tiles of a light field, which they refer to.
[[nodiscard]] std::vector<PlaneImage> images_of(const LightField&);

// A plane image with its texels.
struct PlaneTile {
  Eigen::Vector2f min_m = Eigen::Vector2f::Zero();
  Eigen::Vector2f max_m = Eigen::Vector2f::Zero();
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector4f> texels;

  [[nodiscard]] PlaneImage image() const { return {min_m, max_m, width, height, texels.data()}; }
  [[nodiscard]] Eigen::Vector2f position(int column, int row) const { return image().position(column, row); }
};

[[nodiscard]] PlaneTile black_tile(const Eigen::Vector2f& min_m, const Eigen::Vector2f& max_m, int width, int height);

// Light that a picture asks for: the cells of a DirectionSet that it takes as one, and the part of the plane at which
// it looks them up (plane coordinates, metres).
struct TileRequest {
  std::vector<std::uint32_t> cells;
  Eigen::Vector2f min_m = Eigen::Vector2f::Zero();
  Eigen::Vector2f max_m = Eigen::Vector2f::Zero();
};

// For each request the mean radiance over its cells, weighted by their solid angles, over the whole rectangle.
// Precondition: an image for each direction, all of one rectangle and size.
[[nodiscard]] std::vector<PlaneTile> merged_tiles(const DirectionSet&, std::span<const PlaneImage>,
                                                  std::span<const TileRequest>);

}  // namespace mf
