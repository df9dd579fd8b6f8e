// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace mf {

// A sensor's response as the code that an exposure gives, over u = ln(exposure):
//
//   f(u) = black + Σ a_k B((u − first_u)/step − k),     a_{k+1} − a_k = exp(q_k),   B the uniform cubic B-spline
//   f(u) = black + (f(first_u) − black) e^{u − first_u}  below first_u: a line through the black level
//
// The increments are exponentials, so f rises whatever the q. q is ln(df/du) (plus a constant): a linear sensor has
// q' = 1, a logarithmic one q' = 0, a power law q' = γ — straight lines all, so that a straight continuation of q is a
// sensible guess where no data are, and a change of q' is what a prior may call rare.
class CodeSpline {
 public:
  CodeSpline(double first_u, double step, double black, std::vector<double> log_increments);

  struct Local {
    double value = 0;             // code
    double slope = 0;             // d code / du
    std::size_t first = 0;        // of the four coefficients that matter here
    std::array<double, 4> basis;  // d code / d a_{first + i}
  };
  [[nodiscard]] Local at(double u) const;
  // Precondition: code > black. Beyond the last coefficient the curve goes on with its last slope.
  [[nodiscard]] double u_of(double code) const;

  [[nodiscard]] double first_u() const { return first_u_; }
  [[nodiscard]] double last_u() const;  // the data's domain ends here
  [[nodiscard]] double step() const { return step_; }
  [[nodiscard]] double black() const { return black_; }
  [[nodiscard]] const std::vector<double>& log_increments() const { return log_increments_; }
  [[nodiscard]] std::size_t coefficient_count() const { return coefficients_.size(); }

 private:
  double first_u_, step_, black_;
  std::vector<double> log_increments_;  // q
  std::vector<double> coefficients_;    // a, one more than q
};

}  // namespace mf
