// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

namespace mf {

// A view that could speak for a ray. Lower penalty: a better view.
struct ViewPenalty {
  std::uint32_t view = 0;
  float penalty = 0;  // ≥ 0; the unit is the caller's (an angle, or a distance of rays); infinite: says nothing
};

struct ViewWeight {
  std::uint32_t view = 0;
  float weight = 0;  // the weights of a ray sum to 1
};

// Far below what 8 bits or a half float show beside a view that is better.
inline constexpr float ray_weight_tie = 1e-6F;

// Buehler, Bosse, McMillan, Gortler, Cohen 2001, §4.1: of the candidates the k with the least penalty speak, each with
//
//   w = (1 − penalty / threshold) / penalty,   threshold = the (k + 1)-th least penalty,
//
// before they are normalized. The adaptive threshold lets a view fade out before it leaves the k-neighbourhood;
// 1/penalty makes a view that saw the very ray speak alone (epipole consistency). `floor` > 0 is the penalty below
// which views count as equally exact. A threshold of infinity leaves 1/penalty: what the formula tends to as the
// (k + 1)-th view fades out at its border, so that nothing jumps when it is gone.
// Always > 0: views that tie with the threshold share what no better one takes.
[[nodiscard]] inline float ray_weight(float penalty, float threshold, float floor) {
  const float fading = 1 - (penalty + floor) / (threshold + floor);
  return ((fading > 0 ? fading : 0) + ray_weight_tie) / (penalty + floor);
}

// Reorders `candidates`. Writes at most k weights into `out` (which holds k) and returns how many; 0 when none of the
// candidates has a finite penalty.
std::size_t blend_weights(std::span<ViewPenalty> candidates, int k, float floor, std::span<ViewWeight> out);

}  // namespace mf
