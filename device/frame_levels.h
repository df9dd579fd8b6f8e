// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/frame.h"
#include "common/image.h"
#include "common/response_curve.h"

namespace mf {

// Pixels [x, x + width) × [y, y + height) of a frame.
struct PixelBox {
  int x = 0, y = 0, width = 0, height = 0;
  [[nodiscard]] bool operator==(const PixelBox&) const = default;
};

// Sensor codes made linear by table look-up, in the two forms that the rig needs. Fast: some 3 ms at 1024².
//
// A mosaic is smoothed by the 3 × 3 binomial filter, whose weights are ¼ red, ½ green, ¼ blue at every pixel whatever
// the order: the pattern vanishes at full resolution, for any white balance, and nothing moves by half a pixel.
// Vignetting is not removed: it is smooth, and shifts no edge.
class FrameLevels {
 public:
  // Precondition: codes of `format` (mono or Bayer), and a response of as many channels.
  FrameLevels(const ResponseCurve&, const PixelFormat&);

  // Eight bits to find tags in: proportional to the square root of radiance, which spends more levels on shadows, with
  // a logarithmic shoulder above what a hundredth of the box's lit pixels exceed, or twice what a tenth does. Edges are
  // shifted towards the dark: corners must be aligned on linear().
  // Mono pictures are not smoothed. Precondition: the box lies in the frame.
  [[nodiscard]] ImageU8 levels(const ImageU16& codes, const PixelBox&) const;

  // The same box, linear, in relative exposure.
  [[nodiscard]] ImageF linear(const ImageU16& codes, const PixelBox&) const;

  // Linear luminance, (R + 2 G + B) / 4, the mean of each block of reduction × reduction pixels (those beyond the last
  // whole block are left out). Scale: relative exposure. Precondition: `reduction` is even, ≥ 2.
  [[nodiscard]] ImageF luminance(const ImageU16& codes, int reduction) const;

 private:
  struct Stretch {
    std::array<std::vector<std::uint16_t>, 3> level;  // by colour and code, in sixteenths of a level
  };
  [[nodiscard]] Stretch stretch_for(const ImageU16& codes, const PixelBox&) const;

  PixelFormat format_;
  std::size_t last_code_;
  std::array<std::vector<float>, 3> exposure_;  // by colour and code; mono: the first
};

// A picture for people: square roots of the luminance, so that shadows show, white where a hundredth of it is brighter.
[[nodiscard]] ImageU8 preview_of(const ImageF& luminance);

}  // namespace mf
