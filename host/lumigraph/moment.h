// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "host/lumigraph/posed_photo.h"

namespace mf {

// The time of a new view of a scene that moves: a motion lumigraph. A photo that was taken at another time gets an
// additional penalty (Buehler et al. 2001, §5: a periodic motion filmed by one camera that moves),
//
//   penalty = (α · angle + β · resolution + τ · |t − t_photo|) / weight^γ
//
// where a periodic motion's time goes round: times that differ by a whole number of periods are the same. A photo of
// this time taken elsewhere and one of another time taken here so weigh against each other; only a photo of this place
// and this time speaks alone.
struct Moment {
  double time_s = 0;
  double period_s = std::numeric_limits<double>::infinity();  // > 0; infinite: the motion does not come again
  double penalty_per_s = 0;                                   // τ ≥ 0

  // What is wrong, in words that name the field; nothing when all is well.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// 0 … period / 2, seconds.
[[nodiscard]] double time_between(double a_s, double b_s, double period_s);

// From a τ per period to one per second: without a period the photos' whole time counts as one. Throws InputError
// naming the photo that has no time.
[[nodiscard]] Moment moment_of(const PhotoSet&, std::optional<double> period_s, double penalty_per_period);

}  // namespace mf
