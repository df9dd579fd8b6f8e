// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "common/response_curve.h"

namespace mf {

// How a sensor turns light into charge within one exposure. Light is relative: 1 just fills a pixel that is linear;
// charge is a share of the full pixel; times are shares of the exposure, from its start.

// Charge = light, up to a full pixel.
struct LinearSensor {
  [[nodiscard]] bool operator==(const LinearSensor&) const = default;
};

// Until `time` a pixel holds no more charge than `level` (what is more is drained, SFNC 2.7 §5.8).
struct SlopeKnee {
  double time = 0;   // (0, 1)
  double level = 0;  // (0, 1)
  [[nodiscard]] bool operator==(const SlopeKnee&) const = default;
};
// Piecewise linear: with knees (t₁, s₁) … (tₙ, sₙ), t₀ = 0, tₙ₊₁ = sₙ₊₁ = 1
//
//   q(tₖ) = min(q(tₖ₋₁) + light · (tₖ − tₖ₋₁), sₖ)
struct MultiSlopeSensor {
  std::vector<SlopeKnee> knees;  // one at least; times and levels both rise
  [[nodiscard]] bool operator==(const MultiSlopeSensor&) const = default;
};

// The LinLog pixel of Photonfocus: a transistor whose gate has a voltage ("value") leaks charge away, the faster the
// fuller the pixel is. value_1 until time_1, then value_2 until time_2, then no leak (manual MAN032 §4.3):
//
//   dq/dt = light − a (exp(q / s) − 1),   a = exp(−level / s),   level = 1 − 0.95 · value
//
// which is linear far below `level` and settles at level + s · ln(light) above. A transistor below its threshold
// conducts e times more for each 36 mV (n kT/q); of a swing of 1.2 V that is s = 0.03. `level` and `s` are the nominal
// sensor's: a real one's are what `mirrorfield photometry` measures.
struct LinLogSensor {
  double value_1 = 0, value_2 = 0;  // 0 no compression to 1 the strongest
  double time_1 = 1, time_2 = 1;    // 0 ≤ time_1 ≤ time_2 ≤ 1
  [[nodiscard]] bool operator==(const LinLogSensor&) const = default;
};

using SensorResponse = std::variant<LinearSensor, MultiSlopeSensor, LinLogSensor>;

// What makes it no sensor's, in a few words; empty when nothing does.
[[nodiscard]] std::string fault_of(const SensorResponse&);
// Charge at the end of the exposure, 0 to 1; never decreases with light. Precondition: no fault; light ≥ 0.
[[nodiscard]] double charge_of(const SensorResponse&, double light);
// The least light that gives this charge, at most `brightest_light`. Precondition: no fault; 0 ≤ charge ≤ 1.
[[nodiscard]] double light_of(const SensorResponse&, double charge);
inline constexpr double brightest_light = 1e8;

// code = black_level + charge · (last code − black_level). `full_pixel` is the relative exposure at light = 1: the dark
// part is that of linear_response(bits, black_level, full_pixel, channels). Codes that no light below brightest_light
// reaches count as saturated. Precondition: no fault.
[[nodiscard]] ResponseCurve sensor_response(const SensorResponse&, int bits, double black_level, double full_pixel,
                                            int channels);

}  // namespace mf
