// SPDX-License-Identifier: Apache-2.0
#include "host/blending/view_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mf {

std::size_t blend_weights(std::span<ViewPenalty> candidates, int k, float floor, std::span<ViewWeight> out) {
  const auto end = std::partition(candidates.begin(), candidates.end(),
                                  [](const ViewPenalty& c) { return std::isfinite(c.penalty); });
  const auto speaking = static_cast<std::size_t>(end - candidates.begin());
  const std::size_t wanted = std::min({static_cast<std::size_t>(k), speaking, out.size()});
  if (wanted == 0) return 0;
  float threshold = std::numeric_limits<float>::infinity();
  if (speaking > wanted) {
    std::nth_element(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(wanted), end,
                     [](const ViewPenalty& a, const ViewPenalty& b) { return a.penalty < b.penalty; });
    threshold = candidates[wanted].penalty;
  }
  float sum = 0;
  for (std::size_t i = 0; i < wanted; ++i) {
    out[i] = {candidates[i].view, ray_weight(candidates[i].penalty, threshold, floor)};
    sum += out[i].weight;
  }
  for (std::size_t i = 0; i < wanted; ++i) out[i].weight /= sum;
  return wanted;
}

}  // namespace mf
