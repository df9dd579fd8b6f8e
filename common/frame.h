// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "common/image.h"

namespace mf {

// How a frame's pixels stand for colours. Bayer orders name the first two pixels of the first row, as GenICam does.
enum class PixelLayout { mono, bayer_rg, bayer_gr, bayer_gb, bayer_bg, rgb };

// What a frame's numbers are: sensor codes of `bits` significant bits (8 to 16, in the low bits), or, when
// `linear_float`, values that are already proportional to radiance × exposure.
struct PixelFormat {
  PixelLayout layout = PixelLayout::mono;
  int bits = 12;
  bool linear_float = false;

  [[nodiscard]] int stored_channels() const { return layout == PixelLayout::rgb ? 3 : 1; }
  [[nodiscard]] int colour_channels() const { return layout == PixelLayout::mono ? 1 : 3; }
  [[nodiscard]] int level_count() const { return 1 << bits; }
  [[nodiscard]] bool operator==(const PixelFormat&) const = default;
};

// GenICam-style names: Mono8…Mono16, BayerRG8…BayerBG16, RGB8…RGB16, MonoFloat, RGBFloat. Nothing for any other.
[[nodiscard]] std::optional<PixelFormat> parse_pixel_format(std::string_view name);
[[nodiscard]] std::string pixel_format_name(const PixelFormat&);

// The colour channel (0 red, 1 green, 2 blue; 0 for mono) that a single-channel pixel at (x, y) saw.
[[nodiscard]] inline int colour_at(PixelLayout layout, int x, int y) {
  if (layout == PixelLayout::mono || layout == PixelLayout::rgb) return 0;
  // Position of red in the 2×2 cell, by order; blue is diagonal to it, the rest is green.
  const int red_x = layout == PixelLayout::bayer_gr || layout == PixelLayout::bayer_bg ? 1 : 0;
  const int red_y = layout == PixelLayout::bayer_gb || layout == PixelLayout::bayer_bg ? 1 : 0;
  const bool on_red_column = (x & 1) == red_x;
  const bool on_red_row = (y & 1) == red_y;
  return on_red_column == on_red_row ? (on_red_column ? 0 : 2) : 1;
}

// What a frame is for.
enum class FrameRole { mirror, scene, sweep };
[[nodiscard]] std::string_view frame_role_name(FrameRole);
[[nodiscard]] std::optional<FrameRole> parse_frame_role(std::string_view);

struct FrameInfo {
  std::string name;  // the source's file name, unique in a session for its role
  FrameRole role = FrameRole::mirror;
  double exposure_s = 0;  // > 0
  double nd_density = 0;  // neutral-density filter before the lens: light × 10^−density
  double time_s = 0;      // since the recording's start

  // Light that reached the sensor, relative to one second without a filter.
  [[nodiscard]] double effective_exposure_s() const;
};

using FramePixels = std::variant<ImageU16, ImageF>;  // ImageF exactly when the format is linear_float

struct Frame {
  FrameInfo info;
  FramePixels pixels;
};

}  // namespace mf
