// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "common/response_curve.h"
#include "host/photometry/exposure_sweep.h"
#include "host/photometry/response_fit.h"

namespace mf {

// How well one pixel's exposure, recovered from every unsaturated frame of the sweep, agrees.
//
//   d_ij = (I(y_ij)/t_i) / x_j − 1,   x_j the mean over i weighted by certainty
//
// over all pixels of the channel, and those readings whose own noise is below the limit.
struct SelfConsistency {
  double rms = 0;         // of d
  double noise = 0;       // RMS that the sensor's noise alone gives
  double systematic = 0;  // RMS of the mean d of cells (frame × code range), noise of the means taken out: the curve's
                          // share, and that of wrong exposures
  std::size_t readings = 0;        // that counted
  double share = 0;                // of all unsaturated readings
  std::vector<double> frame_mean;  // certainty-weighted mean d of each frame's clear readings (noise below 20 %):
  // what its filter or shutter is off; NaN: none
};

[[nodiscard]] SelfConsistency measure_self_consistency(const ChannelSamples& all_pixels, const ResponseCurve&,
                                                       int channel, const CodeNoise&, double noise_limit);

}  // namespace mf
