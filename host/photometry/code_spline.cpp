// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/code_spline.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/check.h"

namespace mf {

CodeSpline::CodeSpline(double first_u, double step, double black, std::vector<double> log_increments)
    : first_u_(first_u), step_(step), black_(black), log_increments_(std::move(log_increments)) {
  check(step > 0 && log_increments_.size() >= 3, "a code spline has a positive step and four coefficients or more");
  // Increments below first_u fall by e^−step each (a line through the black level); their sum is the first coefficient.
  coefficients_.push_back(std::exp(log_increments_.front()) / std::expm1(step));
  for (const double q : log_increments_) coefficients_.push_back(coefficients_.back() + std::exp(q));
}

double CodeSpline::last_u() const {
  return first_u_ + step_ * static_cast<double>(coefficients_.size() - 3);
}

CodeSpline::Local CodeSpline::at(double u) const {
  const double end = static_cast<double>(coefficients_.size() - 3);
  const double place = (u - first_u_) / step_;
  const double inside = std::clamp(place, 0.0, end);
  Local local;
  local.first = std::min(coefficients_.size() - 4, static_cast<std::size_t>(inside));
  const double t = inside - static_cast<double>(local.first), s = 1 - t;
  local.basis = {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6,
                 t * t * t / 6};
  const std::array<double, 4> slopes{-s * s / 2, (3 * t * t - 4 * t) / 2, -(3 * s * s - 4 * s) / 2, t * t / 2};
  for (std::size_t i = 0; i < 4; ++i) {
    local.value += local.basis[i] * coefficients_[local.first + i];
    local.slope += slopes[i] * coefficients_[local.first + i] / step_;
  }
  if (place < 0) {
    const double fade = std::exp(u - first_u_);
    for (double& b : local.basis) b *= fade;
    local.value *= fade;
    local.slope = local.value;  // d(e^u)/du
  } else if (place > end) {
    for (std::size_t i = 0; i < 4; ++i) local.basis[i] += slopes[i] * (place - end);
    local.value += local.slope * (place - end) * step_;
  }
  local.value += black_;
  return local;
}

double CodeSpline::u_of(double code) const {
  check(code > black_, "codes above the black level have an exposure");
  const double start = at(first_u_).value;
  if (code <= start) return first_u_ + std::log((code - black_) / (start - black_));
  const Local end = at(last_u());
  if (code >= end.value) return last_u() + (code - end.value) / end.slope;
  double low = first_u_, high = last_u();
  // Bisection to double precision of u over a span of some tens.
  for (int i = 0; i < 52; ++i) {
    const double middle = (low + high) / 2;
    (at(middle).value < code ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace mf
