// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/photo_pyramid.h"

#include <tbb/parallel_for.h>

#include <optional>

#include "host/lumigraph/area_average.h"

namespace mf {

template <typename T>
PhotoPyramid<T>::PhotoPyramid(const Image<T>& photo) {
  Image<T> image = photo;
  for (;;) {
    Level level;
    level.width = image.width;
    level.height = image.height;
    level.scale_x = static_cast<float>(image.width) / static_cast<float>(photo.width);
    level.scale_y = static_cast<float>(image.height) / static_cast<float>(photo.height);
    level.texels.resize(image.data.size() / 3 * 4);
    for (std::size_t i = 0; i < image.data.size() / 3; ++i)
      for (std::size_t c = 0; c < 3; ++c) level.texels[4 * i + c] = image.data[3 * i + c];
    levels_.push_back(std::move(level));
    if (image.width == 1 && image.height == 1) return;
    image = area_average(image, (image.width + 1) / 2, (image.height + 1) / 2);
  }
}

template class PhotoPyramid<std::uint8_t>;
template class PhotoPyramid<float>;

namespace {

template <typename T>
std::vector<PhotoPyramid<T>> pyramids_of(const PhotoSet& set) {
  std::vector<std::optional<PhotoPyramid<T>>> made(set.photos.size());
  tbb::parallel_for(std::size_t{0}, set.photos.size(),
                    [&](std::size_t i) { made[i].emplace(std::get<Image<T>>(set.photos[i].picture)); });
  std::vector<PhotoPyramid<T>> pyramids;
  pyramids.reserve(made.size());
  for (auto& pyramid : made) pyramids.push_back(std::move(*pyramid));
  return pyramids;
}

}  // namespace

PhotoPyramids make_pyramids(const PhotoSet& set) {
  const bool codes = std::holds_alternative<ImageU8>(set.photos.front().picture);
  return codes ? PhotoPyramids(pyramids_of<std::uint8_t>(set)) : PhotoPyramids(pyramids_of<float>(set));
}

}  // namespace mf
