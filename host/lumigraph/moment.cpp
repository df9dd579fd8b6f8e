// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/moment.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mf {

std::optional<std::string> Moment::validate() const {
  if (!std::isfinite(time_s)) return "time: must be a number";
  if (!(period_s > 0)) return "period: must be above 0 seconds";
  if (!(penalty_per_s >= 0) || !std::isfinite(penalty_per_s)) return "time-penalty: must be a number ≥ 0";
  return std::nullopt;
}

double time_between(double a_s, double b_s, double period_s) {
  const double apart = std::abs(a_s - b_s);
  if (std::isinf(period_s)) return apart;
  const double phase = std::fmod(apart, period_s);
  return std::min(phase, period_s - phase);
}

Moment moment_of(const PhotoSet& set, std::optional<double> period_s, double penalty_per_period) {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  for (const PosedPhoto& photo : set.photos) {
    if (!photo.time_s || !std::isfinite(*photo.time_s))
      throw InputError(set.source, photo.name,
                       "has no time: give each frame its \"time\" in seconds (transforms.json)");
    first = std::min(first, *photo.time_s);
    last = std::max(last, *photo.time_s);
  }
  Moment moment;
  moment.time_s = first;
  if (period_s) moment.period_s = *period_s;
  const double whole = period_s ? *period_s : last - first;
  moment.penalty_per_s = whole > 0 ? penalty_per_period / whole : 0;
  return moment;
}

}  // namespace mf
