// SPDX-License-Identifier: Apache-2.0
#include "host/import/frame_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/error.h"
#include "host/io/image_file.h"

namespace mf {

namespace {

void require_kind(const StoredImage& image, const PixelFormat& format, const std::string& file) {
  const bool is_float = std::holds_alternative<ImageF>(image.pixels);
  const int channels = std::visit([](const auto& pixels) { return pixels.channels; }, image.pixels);
  const std::string name = pixel_format_name(format);
  if (is_float != format.linear_float)
    throw InputError(file, "",
                     fmt::format("holds {}, but pixel_format in camera.json is {}: {}",
                                 is_float ? "floating point values" : "integer codes", name,
                                 is_float ? "set it to MonoFloat or RGBFloat" : "give the sensor's format"));
  if (channels != format.stored_channels())
    throw InputError(file, "",
                     fmt::format("has {} channel{}, but pixel_format {} in camera.json needs {}: make them agree",
                                 channels, channels == 1 ? "" : "s", name, format.stored_channels()));
  if (!is_float && image.bits_per_sample < format.bits)
    throw InputError(file, "",
                     fmt::format("stores {} bits, but pixel_format {} in camera.json has {}: save the frames with 16 "
                                 "bits, or correct pixel_format",
                                 image.bits_per_sample, name, format.bits));
}

template <typename Pixel>
std::string place_of(const Image<Pixel>& image, std::size_t index) {
  const std::size_t pixel = index / static_cast<std::size_t>(image.channels);
  const auto width = static_cast<std::size_t>(image.width);
  return fmt::format("pixel ({}, {})", pixel % width, pixel / width);
}

void require_codes(const ImageU16& image, const PixelFormat& format, const std::string& file) {
  const auto highest = std::max_element(image.data.begin(), image.data.end());
  if (*highest < format.level_count()) return;
  // Cameras that put their bits on top leave zeros below in every pixel.
  std::uint16_t all = 0;
  for (const std::uint16_t code : image.data) all = static_cast<std::uint16_t>(all | code);
  const int shift = std::countr_zero(all);
  const bool on_top = shift >= 16 - format.bits;
  throw InputError(
      file, place_of(image, static_cast<std::size_t>(highest - image.data.begin())),
      fmt::format("has code {}, but {} bits end at {}: {}", *highest, format.bits, format.level_count() - 1,
                  on_top ? fmt::format("the codes lie in the high bits, shift them right by {}", 16 - format.bits)
                         : "correct pixel_format in camera.json"));
}

void require_finite(const ImageF& image, const std::string& file) {
  const auto bad = std::find_if_not(image.data.begin(), image.data.end(), [](float v) { return std::isfinite(v); });
  if (bad != image.data.end())
    throw InputError(file, place_of(image, static_cast<std::size_t>(bad - image.data.begin())),
                     fmt::format("is {}: linear frames need finite values", *bad));
}

}  // namespace

Frame read_recorded_frame(const RecordedFrame& recorded, const PixelFormat& format) {
  const std::string file = recorded.file.string();
  StoredImage image = read_stored_image(recorded.file);
  require_kind(image, format, file);
  if (const auto* codes = std::get_if<ImageU16>(&image.pixels)) require_codes(*codes, format, file);
  if (const auto* values = std::get_if<ImageF>(&image.pixels)) require_finite(*values, file);
  return {recorded.info, std::move(image.pixels)};
}

int width_of(const Frame& frame) {
  return std::visit([](const auto& image) { return image.width; }, frame.pixels);
}

int height_of(const Frame& frame) {
  return std::visit([](const auto& image) { return image.height; }, frame.pixels);
}

void require_size(const RecordedFrame& recorded, const Frame& frame, const SessionHeader& header,
                  const std::string& first_name) {
  if (width_of(frame) == header.width && height_of(frame) == header.height) return;
  throw InputError(recorded.file.string(), "",
                   fmt::format("has {} x {} pixels, the first frame ({}) {} x {}: a session has one size, remove the "
                               "frame or take it again",
                               width_of(frame), height_of(frame), first_name, header.width, header.height));
}

}  // namespace mf
