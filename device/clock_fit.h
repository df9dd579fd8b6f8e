// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

namespace mf {

// The camera's clock in the host's time, a line:  host_ns = host_at_ns + (device − device_at_ns) · host_per_device
struct DeviceClock {
  std::int64_t device_at_ns = 0;
  std::int64_t host_at_ns = 0;
  double host_per_device = 1;
  double lateness_ns = 0;  // the mean of how much later than the line the window's frames arrived: their jitter

  [[nodiscard]] std::int64_t host_ns(std::int64_t device_ns) const;
};

// What a pair of times says of the clock before it.
enum class ClockEvent {
  none,
  restarted,  // the device's clock went back: the camera booted, or its counter came to its end
  jumped,     // it leapt, either clock: what was fitted no longer holds
};

struct ClockFitOptions {
  std::int64_t bucket_ns = 500'000'000;      // of device time; the earliest arrival of each counts; > 0
  int buckets = 120;                         // the window: a minute; ≥ 4
  std::int64_t early_ns = 20'000'000;        // so much before the line nothing arrives: a jump; > 0
  std::int64_t late_ns = 100'000'000;        // so much after it, all the time …
  std::int64_t late_for_ns = 2'000'000'000;  // … for so long, is a jump and no delay
};

// Fits a device's clock to the host's CLOCK_MONOTONIC while frames arrive. An arrival is late by a delay that is never
// negative, so what counts is the lower envelope: of the line below all points, the one nearest to them on the whole,
// which is the edge of their lower convex hull at the mean device time (Moon, Skelly & Towsley 1999). The line lies
// later than the truth by the least delay there is, which no one-way fit can see.
//
// Bounded memory: the earliest arrival of each bucket, over a window; a drifting rate is followed within it. Jumps
// smaller than early_ns or late_ns are taken up likewise.
class ClockFit {
 public:
  explicit ClockFit(const ClockFitOptions& = {});

  // In order of arrival. After an event the fit starts over with this pair.
  ClockEvent add(std::int64_t device_ns, std::int64_t host_ns);
  [[nodiscard]] std::optional<DeviceClock> clock() const;  // nothing before the first pair
  [[nodiscard]] int events() const { return events_; }

 private:
  struct Bucket {
    std::int64_t number = 0;
    std::int64_t device_ns = 0;
    std::int64_t host_ns = 0;
    double sum_offsets_ns = 0;  // host − device, relative to the first pair
    int count = 0;
  };
  [[nodiscard]] double offset_of(std::int64_t device_ns, std::int64_t host_ns) const;
  [[nodiscard]] ClockEvent judge(std::int64_t device_ns, std::int64_t host_ns);
  void start_over(std::int64_t device_ns, std::int64_t host_ns);
  void put(std::int64_t device_ns, std::int64_t host_ns);

  ClockFitOptions options_;
  std::deque<Bucket> buckets_;
  std::int64_t first_device_ns_ = 0, first_host_ns_ = 0;
  std::int64_t last_device_ns_ = 0;
  std::optional<std::int64_t> late_since_ns_;  // host
  std::optional<DeviceClock> settled_;         // from whole buckets
  int events_ = 0;
};

}  // namespace mf
