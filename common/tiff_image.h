// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <string_view>

#include "common/frame.h"

namespace mf {

// A picture as a file stores it.
struct StoredImage {
  FramePixels pixels;        // ImageF for floating point samples, else ImageU16 with the codes as they are
  int bits_per_sample = 16;  // of the file: 8 or 16, or 32 for floating point
};

// Rows of a picture: begin, begin + 1 … end − 1.
struct RowRange {
  int begin = 0;
  int end = std::numeric_limits<int>::max();
};

// Baseline TIFF in memory: 8 or 16 bit unsigned or 32 bit float samples, grey (also CFA) or RGB, strips or tiles,
// interleaved or planar, any compression libtiff knows; samples beyond the colours (alpha) are dropped. Nothing is
// scaled and no gamma applied. Throws InputError naming `file` for anything else, and for damaged or truncated data.
//
// Only the strips or tiles that hold some of `rows` are decoded; the rest of the picture is 0.
[[nodiscard]] StoredImage decode_tiff(std::string_view bytes, const std::string& file, const RowRange& rows = {});

enum class TiffCompression { deflate, none };

// 16-bit codes (predictor 2) or 32-bit float (predictor 3), deflate or as they are. One or three channels.
[[nodiscard]] std::string encode_tiff(const FramePixels&, TiffCompression = TiffCompression::deflate);

}  // namespace mf
