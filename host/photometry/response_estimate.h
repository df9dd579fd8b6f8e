// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/progress.h"
#include "common/response_curve.h"
#include "host/photometry/exposure_sweep.h"
#include "host/photometry/self_consistency.h"

namespace mf {

struct ResponseOptions {
  int pixels = 10000;          // of each channel that the fit looks at, spread over brightness; ≥ 100
  double knot_step = 0.1;      // between the curve's knots, in ln(exposure), 0.02 to 1: smaller follows sharper knees
  double kink_scale = 0.0003;  // change of ln(df/dln e)'s slope from knot to knot that counts as none; larger follows
                               // the data more closely and continues them less surely; > 0
  double outlier_sigmas = 3;   // readings further off lose their say (motion, flicker); > 0
  int max_iterations = 60;     // of Gauss–Newton; ≥ 1
  double noise_limit = 0.02;   // self-consistency counts readings whose own noise is below this, relative; > 0

  [[nodiscard]] std::optional<std::string> validate() const;
};

struct ChannelReport {
  double black_level = 0;  // this channel's own estimate, codes
  double black_sigma = 0;
  double observed_fraction = 0;  // of the codes between black and saturation
  int iterations = 0;
  bool converged = false;
  std::size_t pixels = 0;  // that the fit looked at
  SelfConsistency consistency;
};

struct ResponseEstimate {
  ResponseCurve curve;  // radiance_scale 1; channels share one scale: the same code at the middle of what was observed
                        // is exposure 1 in all of them
  std::vector<ChannelReport> channels;
};

// A sensor's response from an exposure sweep, channel by channel (see fit_response). The black level is common to the
// channels when their estimates agree within their uncertainty; otherwise each table starts at its own and the lowest
// is reported. Throws InputError when the sweep cannot tell (ExposureSweep::require_usable; too dark; saturated; the
// codes do not rise with the exposure).
[[nodiscard]] ResponseEstimate estimate_response(const ExposureSweep&, const ResponseOptions&, const Progress& = {});

}  // namespace mf
