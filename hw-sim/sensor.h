// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/frame.h"
#include "common/image.h"
#include "common/response_curve.h"
#include "common/sensor_response.h"
#include "hw-sim/tracer.h"

namespace mf::sim {

// A sensor, behind a Bayer filter or not: the lens' vignetting dims, light is shot-noisy, the response is common/'s
// forward model, read-out adds noise in codes, and everything is rounded and clipped to the codes there are.
struct Sensor {
  ResponseCurve response;  // relative exposure = radiance × seconds; with the vignetting
  PixelFormat format{PixelLayout::bayer_rg, 12, false};
  double electrons_per_exposure = 1e6;  // shot noise: variance of the exposure is exposure / this
  double read_noise_codes = 1;          // standard deviation

  // Codes of the pixels in `region`; the others were not read out and hold the black level. `radiance` has the
  // format's colours, or one channel: a mosaic already.
  [[nodiscard]] ImageU16 expose(const ImageF& radiance, double exposure_s, const Region& region,
                                std::uint64_t seed) const;
};

// 12 bits, black level 64: linear up to radiance 1.5 at 10 ms, logarithmic up to 800.
[[nodiscard]] Sensor desk_sensor();

// What stays of a sensor while its settings change.
struct SensorTraits {
  PixelFormat format{PixelLayout::bayer_rg, 12, false};
  double black_level = 64;      // code
  double full_exposure = 0.01;  // radiance × seconds that fills a linear pixel at gain 0 dB
  double full_electrons = 1e4;  // in a full pixel: shot noise
  double read_noise_codes = 1;  // standard deviation, at gain 0 dB
  Vignetting vignetting{};
};

// The same sensor as a camera that reacts has it: fast enough for 1024² pixels at 37 frames a second on a fraction of a
// core. The response is a table over the exposure in steps of 1/128 octave, straight between them; noise comes from
// a pattern that is drawn once and shifted by chance from row to row and frame to frame, with the standard deviation
// that shot and read noise have in codes at that exposure.
class FastSensor {
 public:
  // Precondition: no fault in the response.
  FastSensor(const SensorTraits&, const SensorResponse&, double gain_db);

  // Codes of a mosaic (one channel: sensor_mosaic()) that `exposure_s` multiplies. Precondition: as many codes as
  // pixels.
  void expose(const ImageF& mosaic, double exposure_s, std::uint64_t seed, std::span<std::uint16_t> codes) const;

 private:
  struct Step {
    float code = 0, code_slope = 0;    // at the step's start, over the light
    float sigma = 0, sigma_slope = 0;  // of all noise, in codes
    float start = 0;                   // light
  };
  std::vector<Step> steps_;
  std::vector<float> noise_;  // standard normal
  float last_code_ = 0;
  double light_per_exposure_ = 1;
};

// What reaches each pixel through its colour filter and the lens: one channel, radiance. `radiance` has three channels
// or one; a mono sensor sees their mean.
[[nodiscard]] ImageF sensor_mosaic(const ImageF& radiance, const SensorTraits&);

}  // namespace mf::sim
