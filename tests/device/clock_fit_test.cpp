// SPDX-License-Identifier: Apache-2.0
#include "device/clock_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace mf {
namespace {

constexpr double period_ns = 1e9 / 37;

// A camera whose clock runs `ppm` too fast, seen over a path that delays every frame: by 0.3 ms at least, by some
// milliseconds on the whole, now and then by a stall in which frames pile up.
struct SimulatedClock {
  double ppm = 50;
  double ppm_per_s = 0;
  double mean_jitter_ns = 2e6;
  double stalls = 0.01;  // share of the seconds
  std::int64_t device_start_ns = 5'000'000'000;
  std::mt19937_64 random{3};
  double busy_until_ns = 0;

  struct Pair {
    std::int64_t device_ns, host_ns, true_host_ns;  // the last: when it would come at once
  };
  Pair frame(int number) {
    const double t = number * period_ns;
    const double device = t * (1 + 1e-6 * (ppm + 0.5 * ppm_per_s * 1e-9 * t));
    std::exponential_distribution<double> jitter(1 / mean_jitter_ns);
    std::uniform_real_distribution<double> chance;
    if (chance(random) < stalls / 37) busy_until_ns = t + 3e8;
    const double arrival = std::max(t + 3e5 + jitter(random), busy_until_ns);
    return {device_start_ns + std::llround(device), 77'000'000'000 + std::llround(arrival),
            77'000'000'000 + std::llround(t + 3e5)};
  }
};

struct Errors {
  double worst_ns = 0, last_rate_ppm = 0;
  int events = 0;
};
Errors follow(SimulatedClock source, double seconds, double warm_up_s) {
  ClockFit fit;
  Errors errors;
  const int frames = static_cast<int>(37 * seconds);
  for (int i = 0; i < frames; ++i) {
    const SimulatedClock::Pair p = source.frame(i);
    (void)fit.add(p.device_ns, p.host_ns);
    if (i < 37 * warm_up_s || i % 10 != 0) continue;
    errors.worst_ns =
        std::max(errors.worst_ns, std::abs(static_cast<double>(fit.clock()->host_ns(p.device_ns) - p.true_host_ns)));
  }
  const double ppm_at_end = source.ppm + source.ppm_per_s * seconds;
  errors.last_rate_ppm = std::abs((1 / fit.clock()->host_per_device - 1) * 1e6 - ppm_at_end);
  errors.events = fit.events();
  return errors;
}

TEST(ClockFit, FindsOffsetAndRateBelowTheJitter) {
  for (const double ppm : {-120.0, 0.0, 50.0}) {
    SimulatedClock clock;
    clock.ppm = ppm;
    const Errors e = follow(clock, 300, 15);
    std::printf("%4.0f ppm: worst %.0f us after 15 s, rate off by %.2f ppm\n", ppm, 1e-3 * e.worst_ns, e.last_rate_ppm);
    EXPECT_LT(e.worst_ns, 1e5);  // a twentieth of the mean jitter
    EXPECT_LT(e.last_rate_ppm, 2);
    EXPECT_EQ(e.events, 0);
  }
}

TEST(ClockFit, FollowsARateThatDrifts) {
  SimulatedClock clock;
  clock.ppm_per_s = 0.02;  // warming up: 12 ppm in ten minutes
  const Errors e = follow(clock, 600, 30);
  EXPECT_LT(e.worst_ns, 2e5);
  EXPECT_LT(e.last_rate_ppm, 2);
  EXPECT_EQ(e.events, 0);
}

TEST(ClockFit, TheFirstPairAlreadyGivesAClock) {
  ClockFit fit;
  EXPECT_FALSE(fit.clock().has_value());
  EXPECT_EQ(fit.add(1000, 5000), ClockEvent::none);
  EXPECT_EQ(fit.clock()->host_ns(2000), 6000);
}

TEST(ClockFit, ARestartIsNoticedAtOnceAndFittedAnew) {
  SimulatedClock clock;
  ClockFit fit;
  for (int i = 0; i < 2000; ++i) {
    const auto p = clock.frame(i);
    EXPECT_EQ(fit.add(p.device_ns, p.host_ns), ClockEvent::none);
  }
  // The camera's clock starts from nothing: booted, or a counter of few bits came to its end.
  const std::int64_t back = clock.frame(2000).device_ns - 1000;
  for (int i = 2000; i < 4000; ++i) {
    const auto p = clock.frame(i);
    EXPECT_EQ(fit.add(p.device_ns - back, p.host_ns), i == 2000 ? ClockEvent::restarted : ClockEvent::none) << i;
  }
  const auto p = clock.frame(4000);
  EXPECT_LT(std::abs(fit.clock()->host_ns(p.device_ns - back) - p.true_host_ns), 500'000);
  EXPECT_EQ(fit.events(), 1);
}

TEST(ClockFit, JumpsOfEitherSignAreNoticed) {
  for (const std::int64_t leap : {400'000'000, -300'000'000}) {
    SimulatedClock clock;
    ClockFit fit;
    int noticed_at = -1;
    for (int i = 0; i < 2500; ++i) {
      const auto p = clock.frame(i);
      // A leap back of the device's clock is hidden in a pause: its times still rise.
      if (i >= 1000 && i < 1020) continue;
      const ClockEvent event = fit.add(p.device_ns + (i >= 1020 ? leap : 0), p.host_ns);
      if (event != ClockEvent::none) {
        EXPECT_EQ(event, ClockEvent::jumped);
        EXPECT_EQ(noticed_at, -1);
        noticed_at = i;
      }
    }
    EXPECT_GE(noticed_at, 1020);
    EXPECT_LE(noticed_at, leap > 0 ? 1030 : 1020 + 37 * 3);
    const auto p = clock.frame(2500);
    EXPECT_LT(std::abs(fit.clock()->host_ns(p.device_ns + leap) - p.true_host_ns), 800'000);
  }
}

TEST(ClockFit, ALongStallIsNoJump) {
  SimulatedClock clock;
  clock.stalls = 0;
  ClockFit fit;
  for (int i = 0; i < 2000; ++i) {
    const auto p = clock.frame(i);
    // The host hangs for 1.5 s, and then takes up all that has waited.
    const bool hangs = i >= 1000 && i < 1055;
    const std::int64_t host = hangs ? clock.frame(1055).host_ns : p.host_ns;
    EXPECT_EQ(fit.add(p.device_ns, std::max(host, p.host_ns)), ClockEvent::none) << i;
  }
}

TEST(ClockFit, HoursDoNotRoundAway) {
  const DeviceClock clock{0, 0, 1 + 1e-6, 0};
  const std::int64_t week = 7LL * 24 * 3600 * 1'000'000'000;
  EXPECT_EQ(clock.host_ns(week + 1) - clock.host_ns(week), 1);
}

}  // namespace
}  // namespace mf
