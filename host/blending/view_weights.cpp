// SPDX-License-Identifier: Apache-2.0
#include "host/blending/view_weights.h"

#include <algorithm>

namespace mf {

std::size_t blend_weights(std::span<ViewPenalty> candidates, int k, float floor, std::span<ViewWeight> out) {
  const std::size_t wanted = std::min({static_cast<std::size_t>(k), candidates.size(), out.size()});
  if (wanted == 0) return 0;
  const auto better = [](const ViewPenalty& a, const ViewPenalty& b) { return a.penalty < b.penalty; };
  float threshold = 0;
  if (candidates.size() > wanted) {
    std::nth_element(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(wanted), candidates.end(),
                     better);
    threshold = candidates[wanted].penalty;
  } else {
    threshold = 1.1F * std::max_element(candidates.begin(), candidates.end(), better)->penalty;
  }
  threshold += floor;
  float sum = 0;
  for (std::size_t i = 0; i < wanted; ++i) {
    const float penalty = candidates[i].penalty + floor;
    out[i] = {candidates[i].view, std::max(0.0F, 1 - penalty / (threshold + 1e-3F * floor)) / penalty};
    sum += out[i].weight;
  }
  for (std::size_t i = 0; i < wanted; ++i)
    out[i].weight = sum > 0 ? out[i].weight / sum : 1.0F / static_cast<float>(wanted);
  return wanted;
}

}  // namespace mf
