// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <random>

#include "common/frame.h"

namespace mf::test {

// Codes that use every one of `bits` bits, the same for the same seed.
inline ImageU16 random_codes(int width, int height, int channels, int bits, unsigned seed = 1) {
  ImageU16 image(width, height, channels);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> code(0, (1 << bits) - 1);
  for (std::uint16_t& value : image.data) value = static_cast<std::uint16_t>(code(random));
  image.data.front() = 0;
  image.data.back() = static_cast<std::uint16_t>((1 << bits) - 1);
  return image;
}

// Linear values over eight decades, some negative (noise below black).
inline ImageF random_radiances(int width, int height, int channels, unsigned seed = 1) {
  ImageF image(width, height, channels);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> decade(-4, 4);
  for (float& value : image.data) value = std::pow(10.0F, decade(random));
  image.data.front() = -1e-3F;
  return image;
}

// Random content of the format.
inline FramePixels random_pixels(const PixelFormat& format, int width, int height, unsigned seed = 1) {
  if (format.linear_float) return random_radiances(width, height, format.stored_channels(), seed);
  return random_codes(width, height, format.stored_channels(), format.bits, seed);
}

[[nodiscard]] inline bool same_pixels(const FramePixels& a, const FramePixels& b) {
  if (a.index() != b.index()) return false;
  return std::visit(
      [&](const auto& left) {
        const auto& right = std::get<std::decay_t<decltype(left)>>(b);
        return left.width == right.width && left.height == right.height && left.channels == right.channels &&
               left.data == right.data;
      },
      a);
}

}  // namespace mf::test
