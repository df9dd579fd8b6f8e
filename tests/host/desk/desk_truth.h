// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "common/image.h"
#include "host/light_field/light_field.h"

namespace mf::test {

// The path-traced desk capture, and how far a result is from its truth. Nothing of it is made by our code.
[[nodiscard]] std::filesystem::path desk_folder();

// A probe (lat-long, as for Blender) against the path-traced one at the same point. Directions within about six degrees
// of the horizon are left out.
struct ProbeError {
  double median_abs_stop = 0;   // |log2(ours / truth)| of luminance
  double irradiance_ratio = 0;  // on a horizontal plane, ours / truth
  double lamp_deg = 0;          // between the brightest places
};
[[nodiscard]] ProbeError probe_error(const ImageF& ours, const ImageF& truth);

// Between the lamp's centre and that of the field's nearest emitter, metres; infinite when the field has none.
//
// No file states where the lamp is. With the true poses all bright rays of the frames, reflected, pass within 4.5 cm
// (its stated radius) of (0.50, 0.32, 0.85); the point from which they stray least lies 0.2 mm from there.
[[nodiscard]] double lamp_error_m(const LightField&);

// The light field's irradiance on the table against plate 0 on the board's white squares, whose albedo is known.
struct TableError {
  double mean_ratio = 0;
  double correlation = 0;
  double relative_rms = 0;
};
[[nodiscard]] TableError table_error(const LightField&);

// PSNR (dB, peak 1) over the pixels that the object changes by more than a tenth. All three are blurred a little first:
// the path tracer's noise is not our error.
[[nodiscard]] double composite_psnr(const ImageF& ours, const ImageF& truth, const ImageF& plate);

}  // namespace mf::test
