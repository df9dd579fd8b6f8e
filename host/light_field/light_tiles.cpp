// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/light_tiles.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "common/check.h"

namespace mf {

std::vector<PlaneImage> images_of(const LightField& field) {
  std::vector<PlaneImage> images;
  for (std::size_t i = 0; i < field.directions.size(); ++i)
    images.push_back({field.plane.min_m.cast<float>(), field.plane.max_m.cast<float>(), field.resolution,
                      field.resolution, field.tile(i)});
  return images;
}

PlaneTile black_tile(const Eigen::Vector2f& min_m, const Eigen::Vector2f& max_m, int width, int height) {
  PlaneTile tile{min_m, max_m, width, height, {}};
  tile.texels.assign(tile.image().texel_count(), Eigen::Vector4f::Zero());
  return tile;
}

std::vector<PlaneTile> merged_tiles(const DirectionSet& directions, std::span<const PlaneImage> images,
                                    std::span<const TileRequest> requests) {
  check(images.size() == directions.size() && !images.empty(), "an image for each direction");
  const PlaneImage& first = images.front();
  std::vector<PlaneTile> tiles(requests.size());
  tbb::parallel_for(std::size_t{0}, requests.size(), [&](std::size_t r) {
    PlaneTile& tile = tiles[r];
    tile = black_tile(first.min_m, first.max_m, first.width, first.height);
    float solid_angle = 0;
    for (const std::uint32_t cell : requests[r].cells) solid_angle += directions.solid_angles_sr[cell];
    for (const std::uint32_t cell : requests[r].cells) {
      const float share = directions.solid_angles_sr[cell] / solid_angle;
      const Eigen::Vector4f* of_cell = images[cell].texels;
      for (std::size_t t = 0; t < tile.texels.size(); ++t) tile.texels[t] += share * of_cell[t];
    }
  });
  return tiles;
}

Eigen::Vector4f sample(const PlaneImage& image, const Eigen::Vector2f& p) {
  const auto coordinate = [](float fraction, int size) {
    return std::clamp(fraction * static_cast<float>(size) - 0.5F, 0.F, static_cast<float>(size - 1));
  };
  const Eigen::Vector2f size = image.max_m - image.min_m;
  const float x = coordinate((p.x() - image.min_m.x()) / size.x(), image.width);
  const float y = coordinate((image.max_m.y() - p.y()) / size.y(), image.height);
  const int x0 = std::min(static_cast<int>(x), std::max(0, image.width - 2));
  const int y0 = std::min(static_cast<int>(y), std::max(0, image.height - 2));
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const int step = image.width > 1 ? 1 : 0;
  const Eigen::Vector4f* row = image.texels + static_cast<std::ptrdiff_t>(y0) * image.width + x0;
  const Eigen::Vector4f* below = row + (image.height > 1 ? image.width : 0);
  return (1 - fy) * ((1 - fx) * row[0] + fx * row[step]) + fy * ((1 - fx) * below[0] + fx * below[step]);
}

}  // namespace mf
