// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "common/frame.h"
#include "common/image.h"
#include "common/response_curve.h"
#include "hw-sim/tracer.h"

namespace mf::sim {

// A LinLog sensor behind a Bayer filter: light is shot-noisy, the response is common/'s forward model, read-out adds
// noise in codes, and everything is rounded and clipped to the codes there are.
struct Sensor {
  ResponseCurve response;  // relative exposure = radiance × seconds
  PixelFormat format{PixelLayout::bayer_rg, 12, false};
  double electrons_per_exposure = 1e6;  // shot noise: variance of the exposure is exposure / this
  double read_noise_codes = 1;          // standard deviation

  // Codes of the pixels in `region`; the others were not read out and hold the black level.
  [[nodiscard]] ImageU16 expose(const ImageF& radiance, double exposure_s, const Region& region,
                                std::uint64_t seed) const;
};

// 12 bits, black level 64: linear up to radiance 1.5 at 10 ms, logarithmic up to 800.
[[nodiscard]] Sensor desk_sensor();

}  // namespace mf::sim
