// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace mf {

// How well a captured view speaks for a ray, in numbers that every renderer of views shares.
//
//   penalty = (α · angle + β · resolution) / weight^γ        after Buehler et al. 2001, §4.1
//
// with angle, resolution and weight as in RayTerms. Buehler adds the field-of-view term; dividing by it instead keeps a
// view that saw the very ray at penalty 0 up to its border (epipole consistency), and still sends the penalty to
// infinity where the view ends, so that it fades out before it is gone (continuity).
struct PenaltyOptions {
  int k = 4;                // views that speak for a ray, 1 to 64: more is smoother, and blurs where the proxy is wrong
  float angle = 1;          // α ≥ 0: per unit of the caller's angular measure
  float resolution = 0.1F;  // β ≥ 0: per octave by which a view saw the point more coarsely than it is wanted
  float border = 1;         // γ > 0: how strongly views are shunned near their border and half hidden points

  // What is wrong, in words that name the field; nothing when all is well.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// A view and a ray that meets the proxy at X.
struct RayTerms {
  float angle = 0;  // ≥ 0: between the wanted ray and the view's, at X (radians, or metres by which it passes by)
  float resolution = 0;  // ≥ 0, octaves: see coarseness()
  float weight = 0;      // 0…1: field of view with its soft border, times visibility; 0: the view says nothing
};

// log₂ of a positive, normal number within 2e-5, free of branches: loops that call it are vectorized.
[[nodiscard]] inline float approximate_log2(float value) {
  const auto bits = std::bit_cast<std::int32_t>(value);
  const auto exponent = static_cast<float>((bits >> 23) - 127);
  const float m = std::bit_cast<float>((bits & 0x007FFFFF) | 0x3F800000) - 1;  // 0 ≤ m < 1
  // Least maximal error among polynomials of degree 5 that are exact at 0 and 1: octaves join without a step.
  return exponent + m * (1.4419170F + m * (-0.7090964F + m * (0.4156059F + m * (-0.1935755F + m * 0.0451490F))));
}

// Infinite where the view says nothing.
[[nodiscard]] inline float penalty_of(const PenaltyOptions& o, const RayTerms& terms) {
  if (!(terms.weight > 0)) return std::numeric_limits<float>::infinity();
  const float plain = o.angle * terms.angle + o.resolution * terms.resolution;
  return o.border == 1 ? plain / terms.weight : plain / std::pow(terms.weight, o.border);
}

// The resolution term: octaves by which a patch of the proxy covers fewer pixels of the view than of the wanted
// picture. Both are areas in the pictures, the Jacobian determinant of the homography that the patch's plane induces. A
// view that saw it more finely has no advantage: its picture is filtered down.
[[nodiscard]] inline float coarseness(float area_in_view, float area_wanted) {
  constexpr float never_seen = 32;  // octaves
  return area_in_view > 0 ? std::clamp(0.5F * std::log2(area_wanted / area_in_view), 0.0F, never_seen) : never_seen;
}

}  // namespace mf
