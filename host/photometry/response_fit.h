// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "host/photometry/code_spline.h"
#include "host/photometry/exposure_sweep.h"

namespace mf {

// Standard deviation of a single reading, by the code that it scatters about: linear between the given codes.
struct CodeNoise {
  std::vector<double> code;   // rising
  std::vector<double> sigma;  // codes, > 0

  [[nodiscard]] double at(double c) const;
};

// What one channel's fit needs to know beside the samples.
struct FitProblem {
  ChannelSamples samples;
  double black = 0;        // where to start
  double black_sigma = 0;  // how far from there, a priori; 0: black is known
  double saturation = 0;   // codes from here on only bound
  double last_code = 0;    // 2^bits − 1: the curve is wanted up to here
  double dark_noise = 1;   // standard deviation of a reading in the dark, codes
};

struct FitOptions {
  double knot_step = 0.1;          // of ln(exposure); smaller follows sharper knees
  double kink_scale = 0.0003;      // size of a change of slope of ln(df/du) from knot to knot that counts as none; > 0
  double first_kink_scale = 0.05;  // the first iteration's: any shape is as likely; it shrinks to kink_scale
  double outlier_sigmas = 3;       // residuals beyond lose their say (Cauchy)
  int max_iterations = 60;         // of Gauss–Newton
};

struct ChannelFit {
  CodeSpline curve;
  double black_sigma = 0;  // of curve.black(), a posteriori
  CodeNoise noise;
  // Of the curve's coefficients and, last, the black level. When black was known that entry means nothing.
  Eigen::MatrixXd covariance;
  int iterations = 0;
  bool converged = false;
};

// A rough curve without a starting point: least squares on ln(exposure), which is linear in the unknowns (the curve at
// some codes, the pixels' exposures), over readings well above the dark. Nothing when the samples do not connect.
[[nodiscard]] std::optional<CodeSpline> rough_curve(const FitProblem&, const FitOptions&);

// Robertson, Borman & Stevenson 2003: the curve and every pixel's exposure that make the codes most probable,
//
//   minimize  Σ_ij  ρ( (y_ij − f(ln t_i + u_j)) / σ(f) )  +  Σ_k ln(1 + (Δ²q_k / kink_scale)²)
//
// Their certainty weights 1/(σ I'(y))² turn an error of exposure into one of code; here the error is taken on the code
// itself, which is the same to first order but stays unbiased where noise is as large as the signal, near black.
// The u_j are eliminated (Schur), σ is measured from the residuals. A saturated reading only pulls upwards.
[[nodiscard]] ChannelFit fit_response(const FitProblem&, const FitOptions&, const CodeSpline& start);

}  // namespace mf
