// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/posed_photo.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/check.h"
#include "common/error.h"
#include "host/lumigraph/area_average.h"

namespace mf {

namespace {

void check_photo(const PosedPhoto& photo, const std::string& source) {
  const int width = width_of(photo.picture);
  const int height = height_of(photo.picture);
  if (width < 2 || height < 2) throw InputError(source, photo.name, "is smaller than 2 × 2 pixels: leave it out");
  if (photo.camera.width != width || photo.camera.height != height)
    throw InputError(source, photo.name,
                     fmt::format("is {} × {} but its camera {} × {}: give the camera of this picture", width, height,
                                 photo.camera.width, photo.camera.height));
  if (!photo.mask.empty() && (photo.mask.width != width || photo.mask.height != height))
    throw InputError(source, photo.name,
                     fmt::format("is {} × {} but its mask {} × {}: make the mask from this picture", width, height,
                                 photo.mask.width, photo.mask.height));
  if (!(photo.camera.fx() > 0 && photo.camera.fy() > 0))
    throw InputError(source, photo.name, "has a focal length that is not positive: give it in pixels");
  const auto& p = photo.camera.parameters;
  if (!std::all_of(p.begin(), p.end(), [](double v) { return std::isfinite(v); }) ||
      !photo.cam_from_world.translation.allFinite() || !photo.cam_from_world.rotation.coeffs().allFinite())
    throw InputError(source, photo.name, "has a camera or a pose that is not finite: leave it out or mend it");
  if (const auto* linear = std::get_if<ImageF>(&photo.picture)) {
    const auto bad =
        std::find_if(linear->data.begin(), linear->data.end(), [](float value) { return !std::isfinite(value); });
    if (bad != linear->data.end()) {
      const auto pixel = static_cast<int>((bad - linear->data.begin()) / 3);
      throw InputError(
          source, photo.name,
          fmt::format("holds NaN or infinity at pixel ({}, {}): repair the picture", pixel % width, pixel / width));
    }
  }
}

}  // namespace

void check_photos(const PhotoSet& set) {
  if (set.photos.empty()) throw InputError(set.source, "", "holds no photo: add at least two");
  std::set<std::string> names;
  for (const PosedPhoto& photo : set.photos) {
    check_photo(photo, set.source);
    if (photo.picture.index() != set.photos.front().picture.index())
      throw InputError(set.source, photo.name,
                       "and " + set.photos.front().name + " are of two kinds (8-bit and linear): convert one");
    if (!names.insert(photo.name).second)
      throw InputError(set.source, photo.name, "is listed twice: leave one of them out");
  }
}

PhotoSet scaled(PhotoSet set, double scale) {
  check(scale > 0 && scale <= 1, "photos are scaled down");
  if (scale == 1) return set;
  for (PosedPhoto& photo : set.photos) {
    const int width = std::max(2, static_cast<int>(std::lround(photo.camera.width * scale)));
    const int height = std::max(2, static_cast<int>(std::lround(photo.camera.height * scale)));
    std::visit([&](auto& image) { image = area_average(image, width, height); }, photo.picture);
    if (!photo.mask.empty()) photo.mask = area_average(photo.mask, width, height);
    auto& p = photo.camera.parameters;
    for (const std::size_t i : {0U, 2U}) p[i] *= static_cast<double>(width) / photo.camera.width;
    for (const std::size_t i : {1U, 3U}) p[i] *= static_cast<double>(height) / photo.camera.height;
    photo.camera.width = width;
    photo.camera.height = height;
  }
  return set;
}

}  // namespace mf
