// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace mf {

// By value: the references of std::min and std::max keep a loop from being vectorized.
inline float larger(float a, float b) {
  return a > b ? a : b;
}
inline float smaller(float a, float b) {
  return a < b ? a : b;
}

// From 0 at t ≤ 0 to 1 at t ≥ 1, without a bend at either.
inline float smooth(float t) {
  const float c = smaller(larger(t, 0.0F), 1.0F);
  return c * c * (3 - 2 * c);
}

}  // namespace mf
