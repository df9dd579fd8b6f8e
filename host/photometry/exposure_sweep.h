// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "common/frame.h"

namespace mf {

// One static scene at several known exposures: what a response curve is estimated from. Filters count as shorter
// exposures: FrameInfo::effective_exposure_s().
struct ExposureSweep {
  std::string source;  // the session or folder, for error messages
  PixelFormat format;
  std::vector<Frame> frames;    // of one size, in any order
  double black_level_hint = 0;  // code; 0: unknown

  // Throws InputError unless there are two frames or more of one size, with positive, finite exposures, not all equal.
  void require_usable() const;
};

// What the darkest frame says: codes over the tenth of pixels that is darkest in the brightest frame (chosen elsewhere
// than measured, so that noise does not pull them down).
struct DarkReading {
  double code = 0;          // mean: the black level is not above it
  double noise = 1;         // standard deviation of a reading, codes
  double extrapolated = 0;  // black level, if the two darkest exposures lie on the sensor's linear toe
};
[[nodiscard]] DarkReading darkest_reading(const ExposureSweep&);

// Throws InputError naming the frames when a longer exposure gives a darker picture, or none of them changes anything.
void require_rising_codes(const ExposureSweep&, const DarkReading&);

// The first code that no longer tells light apart: the lower edge of the plateau on which pixels stay when the exposure
// rises, or the last code when the sweep shows no such plateau.
[[nodiscard]] double saturation_code(const ExposureSweep&, const DarkReading&);

// Some pixels of one colour, all their codes.
struct ChannelSamples {
  std::vector<double> log_exposure;  // ln of each frame's effective exposure
  std::vector<float> codes;          // pixel by pixel, a code per frame

  [[nodiscard]] std::size_t frame_count() const { return log_exposure.size(); }
  [[nodiscard]] std::size_t pixel_count() const { return codes.size() / log_exposure.size(); }
  [[nodiscard]] const float* pixel(std::size_t i) const { return codes.data() + i * log_exposure.size(); }
};

// Every pixel of a colour channel.
[[nodiscard]] ChannelSamples channel_samples(const ExposureSweep&, int channel);

// Up to `count` of them, spread evenly over brightness: a lamp of a hundred pixels alone knows the upper codes.
// Only pixels with two unsaturated readings, one of them above `clear`, are taken.
[[nodiscard]] ChannelSamples spread_samples(const ChannelSamples&, std::size_t count, double clear, double saturation);

}  // namespace mf
