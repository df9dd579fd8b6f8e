// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "common/frame.h"

namespace mf {

// A picture as a file stores it.
struct StoredImage {
  FramePixels pixels;        // ImageF for floating point samples, else ImageU16 with the codes as they are
  int bits_per_sample = 16;  // of the file: 8 or 16, or 32 for floating point
};

// Baseline TIFF in memory: 8 or 16 bit unsigned or 32 bit float samples, grey (also CFA) or RGB, strips or tiles,
// interleaved or planar, any compression libtiff knows; samples beyond the colours (alpha) are dropped. Nothing is
// scaled and no gamma applied. Throws InputError naming `file` for anything else, and for damaged or truncated data.
[[nodiscard]] StoredImage decode_tiff(std::string_view bytes, const std::string& file);

enum class TiffCompression { deflate, none };

// 16-bit codes (predictor 2) or 32-bit float (predictor 3), deflate or as they are. One or three channels.
[[nodiscard]] std::string encode_tiff(const FramePixels&, TiffCompression = TiffCompression::deflate);

}  // namespace mf
