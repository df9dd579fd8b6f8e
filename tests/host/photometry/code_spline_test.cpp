// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/code_spline.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mf {
namespace {

std::vector<double> wavy() {
  std::vector<double> q;
  q.reserve(40);
  for (int k = 0; k < 40; ++k) q.push_back(0.1 * std::min(k, 20) + 0.2 * std::sin(0.7 * k));
  return q;
}

TEST(CodeSpline, RisesWhateverTheIncrements) {
  const CodeSpline f(-3, 0.1, 64, wavy());
  double before = 64;
  for (double u = -8; u < 3; u += 0.01) {
    const double value = f.at(u).value;
    EXPECT_GT(value, before) << u;
    before = value;
  }
}

TEST(CodeSpline, InverseFindsTheExposure) {
  const CodeSpline f(-3, 0.1, 64, wavy());
  for (double u = -6; u < 2; u += 0.17) EXPECT_NEAR(f.u_of(f.at(u).value), u, 1e-9);
}

TEST(CodeSpline, SlopeAndBasisAreTheDerivatives) {
  const CodeSpline f(-3, 0.1, 64, wavy());
  for (const double u : {-4.0, -3.02, -2.95, -1.234, 0.51, f.last_u() - 0.01, f.last_u() + 0.4}) {
    const CodeSpline::Local at = f.at(u);
    const double h = 1e-5;
    EXPECT_NEAR(at.slope, (f.at(u + h).value - f.at(u - h).value) / (2 * h), 1e-5 * at.slope) << u;
    // Increment k moves every later coefficient by exp(q_k) dq.
    for (std::size_t k = 1; k < f.log_increments().size(); ++k) {
      std::vector<double> more = wavy(), less = wavy();
      more[k] += h;
      less[k] -= h;
      const double numeric =
          (CodeSpline(-3, 0.1, 64, more).at(u).value - CodeSpline(-3, 0.1, 64, less).at(u).value) / (2 * h);
      double analytic = 0;
      for (std::size_t i = 0; i < 4; ++i)
        if (at.first + i > k) analytic += at.basis[i] * std::exp(wavy()[k]);
      EXPECT_NEAR(numeric, analytic, 1e-6 * (1 + std::abs(analytic))) << u << ' ' << k;
    }
  }
}

TEST(CodeSpline, EqualStepsOfQAreALinearSensor) {
  std::vector<double> q;
  q.reserve(60);
  for (int k = 0; k < 60; ++k) q.push_back(0.1 * k);  // q' = 1
  const CodeSpline f(0, 0.1, 10, q);
  const double gain = (f.at(2).value - 10) / std::exp(2);
  for (double u = -2; u < 5.5; u += 0.13) EXPECT_NEAR((f.at(u).value - 10) / (gain * std::exp(u)), 1, 1e-6);
}

}  // namespace
}  // namespace mf
