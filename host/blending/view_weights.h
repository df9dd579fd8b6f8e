// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace mf {

// A view that could speak for a ray. Lower penalty: a better view.
struct ViewPenalty {
  std::uint32_t view = 0;
  float penalty = 0;  // ≥ 0; the unit is the caller's (an angle, or a distance of rays)
};

struct ViewWeight {
  std::uint32_t view = 0;
  float weight = 0;  // the weights of a ray sum to 1
};

// Buehler, Bosse, McMillan, Gortler, Cohen 2001, §4.1: of the candidates the k with the least penalty speak, each with
//
//   w = (1 − penalty / threshold) / penalty,   threshold = the (k + 1)-th least penalty,
//
// normalized. The adaptive threshold lets a view fade out before it leaves the k-neighbourhood; 1/penalty makes a view
// that saw the very ray speak alone (epipole consistency). `floor` > 0 is the penalty below which views count as
// equally exact. With no more than k candidates the threshold lies a tenth above the worst.
//
// Reorders `candidates`. Writes at most k weights into `out` (which holds k) and returns how many.
std::size_t blend_weights(std::span<ViewPenalty> candidates, int k, float floor, std::span<ViewWeight> out);

}  // namespace mf
