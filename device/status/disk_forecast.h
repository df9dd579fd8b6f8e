// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

#include "device/rig_status.h"

namespace mf {

// How long the disk will last, from how its free space fell over the last half minute of this recording. That counts
// all that goes onto it, whoever writes.
class DiskForecast {
 public:
  using Clock = std::chrono::steady_clock;
  // Seconds until nothing is free; unknown while nothing is recorded, in the first 5 s, and while the space does not
  // fall.
  [[nodiscard]] std::optional<double> seconds_left(const RigStatus&, Clock::time_point now);

 private:
  struct Reading {
    Clock::time_point at;
    std::int64_t free_bytes;
  };
  std::deque<Reading> readings_;  // a second apart
};

}  // namespace mf
