// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "host/blending/view_weights.h"

namespace mf {

[[nodiscard]] inline bool ranks_before(const ViewPenalty& a, const ViewPenalty& b) {
  return a.penalty < b.penalty || (a.penalty == b.penalty && a.view < b.view);
}

// The `wanted` least of many penalties, without ordering all of them: only those below a bound are looked at, which is
// widened until enough are. Neighbouring rays have similar bounds, so the last one is where the next search begins;
// what is found does not depend on it.
class ViewRanking {
 public:
  // `lower_bound[i]` ≤ the penalty of view i, which `penalty_of(i)` computes (infinite: it has no say). The result is
  // valid until the next call; in no order. `announce(i)` comes for each of some views before their penalties are asked
  // for: what these need can be fetched meanwhile.
  template <typename PenaltyOf, typename Announce>
  const std::vector<ViewPenalty>& find(const float* lower_bound, std::size_t count, std::size_t wanted,
                                       const PenaltyOf& penalty_of, const Announce& announce) {
    asked_.resize(std::max(asked_.size(), count));
    float tried = -1;  // views below this bound have been looked at
    least_.clear();
    for (;;) {
      std::size_t within = 0;
      std::size_t asked = 0;
      for (std::size_t i = 0; i < count; ++i) {
        asked_[asked] = static_cast<std::uint32_t>(i);
        asked += lower_bound[i] < bound_ && lower_bound[i] >= tried ? 1 : 0;
      }
      for (std::size_t a = 0; a < asked; ++a) announce(asked_[a]);
      for (std::size_t a = 0; a < asked; ++a) {
        const float penalty = penalty_of(asked_[a]);
        if (penalty < std::numeric_limits<float>::infinity()) least_.push_back({asked_[a], penalty});
      }
      for (const ViewPenalty& v : least_) within += v.penalty < bound_ ? 1 : 0;
      if (within >= wanted || bound_ == std::numeric_limits<float>::max()) break;
      tried = bound_;
      bound_ = bound_ < 1e15F ? 2 * bound_ : std::numeric_limits<float>::max();
    }
    if (least_.size() <= wanted) return least_;
    std::nth_element(least_.begin(), least_.begin() + static_cast<std::ptrdiff_t>(wanted - 1), least_.end(),
                     ranks_before);
    constexpr float slack = 1.2F;  // so that the next search, nearly the same, succeeds at once
    bound_ = std::clamp(slack * least_[wanted - 1].penalty, 1e-12F, 1e15F);
    least_.resize(wanted);
    return least_;
  }

 private:
  float bound_ = 1e-3F;
  std::vector<std::uint32_t> asked_;
  std::vector<ViewPenalty> least_;
};

}  // namespace mf
