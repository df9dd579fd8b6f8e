// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "common/frame.h"
#include "common/image.h"
#include "common/vignetting.h"

namespace mf {

// One colour channel of a sensor's response: code → relative exposure (radiance × effective exposure time, up to
// scale).
struct ResponseChannel {
  std::vector<double> exposure;        // one per code, never decreasing; 0 up to the black level
  std::vector<bool> observed;          // whether data spoke for this code; the rest is interpolated
  std::vector<double> relative_sigma;  // standard deviation of exposure, relative; 0 where unknown
};

// A sensor's response, and what turns its relative exposures into radiance:
//
//   radiance = radiance_scale[c] · exposure[c][code] / (effective_exposure_s · vignetting gain)
//
// The forward model (exposure → code) is what the simulator and the daemon use; the inverse is the table itself.
struct ResponseCurve {
  double black_level = 0;                 // code of no light (may lie between codes)
  double saturation_code = 0;             // codes from here on only bound the light from below
  std::vector<ResponseChannel> channels;  // one (mono) or three (red, green, blue)
  std::vector<double> radiance_scale;     // as many; 1 without an absolute reference
  bool absolute = false;                  // radiance_scale comes from a reference reading
  Vignetting vignetting;

  // Relative exposure of a code, which may lie between two (codes outside the table are clamped to its ends: the
  // sensor cannot produce them, an interpolation can).
  [[nodiscard]] double exposure_of(int channel, double code) const;

  // The code that an exposure gives, fractional and unclipped by quantization; saturates at the table's end.
  [[nodiscard]] double code_of(int channel, double exposure) const;
};

// Forward models. `bits` sets the number of codes, `full_scale` the relative exposure that just reaches the last code.
[[nodiscard]] ResponseCurve linear_response(int bits, double black_level, double full_scale, int channels);
// Linear up to `knee` (exposure), logarithmic above with a continuous slope: the LinLog mode of Photonfocus sensors.
[[nodiscard]] ResponseCurve linlog_response(int bits, double black_level, double knee, double full_scale, int channels);

// Radiance at every pixel of a frame, still as a mosaic when the frame is one (channels as stored). Linear-float frames
// are only divided by the exposure. Pixels at or above saturation keep the radiance of the saturation code.
[[nodiscard]] ImageF linearize(const Frame&, const PixelFormat&, const ResponseCurve&);

// Code → radiance in one colour of a frame: what linearize() looks up, before vignetting.
[[nodiscard]] std::vector<float> radiance_table(const ResponseCurve&, int channel, double effective_exposure_s);

// response.json. Throws InputError naming file and field.
[[nodiscard]] nlohmann::json to_json(const ResponseCurve&);
[[nodiscard]] ResponseCurve response_curve_from_json(const nlohmann::json&, const std::string& file);
[[nodiscard]] ResponseCurve read_response_curve(const std::filesystem::path&);

}  // namespace mf
