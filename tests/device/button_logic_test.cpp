// SPDX-License-Identifier: Apache-2.0
#include "device/button_logic.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace mf {
namespace {

constexpr std::int64_t ms = 1'000'000;

// A contact with a clock in milliseconds; collects what it meant.
class Contact {
 public:
  explicit Contact(bool recording = false) : logic_(ButtonTiming{}) {
    logic_.set_recording(recording);
    level(0, false);
  }
  Contact& level(std::int64_t at_ms, bool pressed) {
    note(logic_.contact(at_ms * ms, pressed), at_ms);
    return *this;
  }
  Contact& until(std::int64_t at_ms) {
    note(logic_.advance(at_ms * ms), at_ms);
    return *this;
  }
  // The contact closes or opens with `bounces` short returns, 1 to 3 ms apart; returns when it has come to rest.
  std::int64_t settle(std::int64_t at_ms, bool pressed, int bounces, std::mt19937& random) {
    level(at_ms, pressed);
    for (int i = 0; i < bounces; ++i) {
      at_ms += 1 + static_cast<int>(random() % 3);
      level(at_ms, !pressed);
      at_ms += 1 + static_cast<int>(random() % 3);
      level(at_ms, pressed);
    }
    return at_ms;
  }
  ButtonLogic& logic() { return logic_; }
  [[nodiscard]] int starts() const { return count(ButtonEvent::start); }
  [[nodiscard]] int stops() const { return count(ButtonEvent::stop); }
  [[nodiscard]] std::int64_t last_ms() const { return last_ms_; }

 private:
  [[nodiscard]] int count(ButtonEvent e) const {
    return static_cast<int>(std::count(events_.begin(), events_.end(), e));
  }
  void note(std::optional<ButtonEvent> event, std::int64_t at_ms) {
    if (!event) return;
    events_.push_back(*event);
    last_ms_ = at_ms;
  }
  ButtonLogic logic_;
  std::vector<ButtonEvent> events_;
  std::int64_t last_ms_ = -1;
};

TEST(ButtonLogic, APressStartsOnceItHasKeptStill) {
  Contact c;
  c.level(100, true).until(129);
  EXPECT_EQ(c.starts(), 0);
  c.until(130);
  EXPECT_EQ(c.starts(), 1);
  EXPECT_EQ(c.logic().deadline_ns(), ButtonLogic::never) << "nothing more comes of this press";
}

TEST(ButtonLogic, AKnockShorterThanTheDebounceIsNothing) {
  for (int length = 1; length < 30; ++length) {
    Contact c;
    c.level(100, true).level(100 + length, false).until(10'000);
    EXPECT_EQ(c.starts() + c.stops(), 0) << length;
  }
}

// Every pattern of 16 levels, 3 ms apart, after which the contact stays closed or open: what counts is the rest.
TEST(ButtonLogic, EveryBounceTrainIsOnePressOrNone) {
  for (unsigned pattern = 0; pattern < 1U << 16; ++pattern)
    for (const bool closes : {true, false}) {
      Contact c;
      for (int i = 0; i < 16; ++i) {
        const bool level = ((pattern >> i) & 1U) != 0;
        c.level(100 + 3 * i, level).until(100 + 3 * i + 1);
      }
      c.level(148, closes).until(5'000);
      // A run of closed levels of 30 ms or more within the train is a press as well: at least 10 of the 16, or fewer
      // that go on into the rest.
      int longest = 0, run = 0;
      for (int i = 0; i < 16; ++i) longest = std::max(longest, run = ((pattern >> i) & 1U) != 0 ? run + 1 : 0);
      const bool expected = closes || longest >= 10;
      ASSERT_EQ(c.starts(), expected ? 1 : 0) << pattern << closes;
      ASSERT_EQ(c.stops(), 0);
    }
}

TEST(ButtonLogic, AShortPressWhileRecordingIsNothing) {
  for (const int length : {31, 100, 500, 999}) {
    Contact c(true);
    c.level(100, true).until(100 + length).level(100 + length, false).until(10'000);
    EXPECT_EQ(c.starts() + c.stops(), 0) << length;
  }
}

TEST(ButtonLogic, AHoldStopsOnce) {
  Contact c(true);
  c.level(100, true).until(1099);
  EXPECT_EQ(c.stops(), 0);
  EXPECT_EQ(c.logic().deadline_ns(), 1100 * ms);
  c.until(1100);
  EXPECT_EQ(c.stops(), 1);
  c.until(20'000).level(20'000, false).until(30'000);
  EXPECT_EQ(c.stops(), 1);
  EXPECT_EQ(c.starts(), 0);
}

TEST(ButtonLogic, APressThatStartedDoesNotStopHoweverLongItIsHeld) {
  Contact c;
  c.level(100, true).until(60'000).level(60'000, false).until(61'000);
  EXPECT_EQ(c.starts(), 1);
  EXPECT_EQ(c.stops(), 0);
}

TEST(ButtonLogic, BouncesDoNotBreakAHold) {
  Contact c(true);
  c.level(100, true);
  for (int at = 200; at < 1100; at += 60) c.level(at, false).level(at + 20, true);
  c.until(1110);
  EXPECT_EQ(c.stops(), 1);
}

TEST(ButtonLogic, LettingGoJustBeforeTheHoldIsNoStop) {
  Contact c(true);
  c.level(100, true).level(1099, false).until(3000);
  EXPECT_EQ(c.stops(), 0);
}

TEST(ButtonLogic, ADoublePressStartsOnce) {
  for (const int between : {31, 60, 200, 900}) {
    Contact c;
    c.level(100, true).until(200).level(200, false).until(200 + between);
    c.level(200 + between, true).until(300 + between).level(300 + between, false).until(9'000);
    EXPECT_EQ(c.starts(), 1) << between;
    EXPECT_EQ(c.stops(), 0);
  }
}

TEST(ButtonLogic, StartsAgainOnceTheRecordingHasEnded) {
  Contact c;
  c.level(100, true).until(200).level(200, false).until(300);
  c.level(1000, true).until(2000);
  EXPECT_EQ(c.stops(), 1);
  c.logic().set_recording(false);
  c.until(4000);
  EXPECT_EQ(c.starts(), 1) << "still held: that is no new press";
  c.level(4000, false).until(4100).level(4100, true).until(4200);
  EXPECT_EQ(c.starts(), 2);
}

TEST(ButtonLogic, ARecordingThatEndedDuringTheHoldIsNotStopped) {
  Contact c(true);
  c.level(100, true).until(500);
  c.logic().set_recording(false);
  c.until(5000);
  EXPECT_EQ(c.starts() + c.stops(), 0);
}

TEST(ButtonLogic, StuckAtStartSaysNothingBeforeItWasLetGo) {
  ButtonLogic logic(ButtonTiming{});
  EXPECT_FALSE(logic.contact(0, true));
  EXPECT_FALSE(logic.advance(60'000 * ms));
  logic.set_recording(true);
  EXPECT_FALSE(logic.advance(120'000 * ms)) << "nor does it stop";
  logic.set_recording(false);
  EXPECT_FALSE(logic.contact(121'000 * ms, false));
  EXPECT_FALSE(logic.contact(121'010 * ms, true)) << "a bounce is no letting go";
  EXPECT_FALSE(logic.advance(122'000 * ms));
  EXPECT_FALSE(logic.contact(123'000 * ms, false));
  EXPECT_FALSE(logic.contact(124'000 * ms, true));
  EXPECT_EQ(logic.advance(124'030 * ms), ButtonEvent::start);
}

TEST(ButtonLogic, UnpluggedWhilePressedIsVoid) {
  Contact c;
  c.level(100, true);
  c.logic().unplugged();
  c.until(5000);
  EXPECT_EQ(c.starts(), 0);
  c.level(6000, true).until(7000);
  EXPECT_EQ(c.starts(), 0) << "plugged in while down";
  c.level(7000, false).until(7100).level(7100, true).until(7200);
  EXPECT_EQ(c.starts(), 1);

  Contact holding(true);
  holding.level(100, true).until(900);
  holding.logic().unplugged();
  holding.level(950, true).until(9000);
  EXPECT_EQ(holding.stops(), 0);
}

TEST(ButtonLogic, TimeThatGoesBackIsTheLastTime) {
  Contact c;
  c.level(1000, true).until(1020).level(500, true).until(400);
  EXPECT_EQ(c.starts(), 0);
  c.until(1030);
  EXPECT_EQ(c.starts(), 1);
  c.level(100, false).until(1059);
  c.logic().set_recording(false);
  c.level(1059, true).until(3000);
  EXPECT_EQ(c.starts(), 1) << "open from 1030 to 1059 only: a bounce";
}

// A process that was not woken for long reads all of it at once: the times decide, not when they are read.
TEST(ButtonLogic, LateReadingMeansTheSame) {
  Contact c;
  c.level(100, true).level(500, false).until(9000);
  EXPECT_EQ(c.starts(), 1);
  Contact holding(true);
  holding.level(100, true).level(1200, false).until(9000);
  EXPECT_EQ(holding.stops(), 1);
  Contact at_once(true);
  at_once.level(100, true).until(9000);
  EXPECT_EQ(at_once.stops(), 1);
}

// The deadline is all that a caller must wake for: fed only then, the same comes out at the same time.
TEST(ButtonLogic, RandomPressesWithBouncesAreCountedAsWhatTheyAre) {
  std::mt19937 random(7);
  for (int run = 0; run < 2000; ++run) {
    Contact c;
    std::int64_t at = 100;
    int starts = 0, stops = 0;
    bool recording = false;
    for (int press = 0; press < 10; ++press) {
      const bool hold = random() % 2 == 0;
      const std::int64_t down = c.settle(at, true, static_cast<int>(random() % 8), random);
      const std::int64_t up = down + (hold ? 1001 + random() % 1000 : 31 + random() % 900);
      while (c.logic().deadline_ns() <= up * ms) c.until((c.logic().deadline_ns() + ms - 1) / ms);
      if (!recording) {
        ++starts;
        recording = true;
      } else if (hold) {
        ++stops;
        recording = false;
        c.logic().set_recording(false);
      }
      at = c.settle(up, false, static_cast<int>(random() % 8), random) + 31 + static_cast<int>(random() % 500);
      c.until(at - 1);
      ASSERT_EQ(c.starts(), starts) << run << " " << press;
      ASSERT_EQ(c.stops(), stops) << run << " " << press;
    }
  }
}

TEST(ButtonLogic, TimingsThatMakeNoSenseAreRefused) {
  using std::chrono::milliseconds;
  EXPECT_STREQ(ButtonTiming{}.problem(), "");
  EXPECT_STRNE((ButtonTiming{milliseconds(0), milliseconds(1000)}).problem(), "");
  EXPECT_STRNE((ButtonTiming{milliseconds(30), milliseconds(30)}).problem(), "");
  EXPECT_STRNE((ButtonTiming{milliseconds(30), milliseconds(10'001)}).problem(), "");
}

}  // namespace
}  // namespace mf
