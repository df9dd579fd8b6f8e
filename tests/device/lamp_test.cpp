// SPDX-License-Identifier: Apache-2.0
#include "device/lamp.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>

#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using namespace std::chrono_literals;

// The share of ten seconds that a pattern is lit, and how often it changes, by walking from change to change.
struct Walk {
  double lit = 0;
  int changes = 0;
};
Walk walk(LampState state) {
  const LampPattern pattern = lamp_pattern(state);
  Walk w;
  std::chrono::nanoseconds at = 0ns;
  bool last = pattern.lit(at);
  while (at < 10s) {
    const auto step = std::min<std::chrono::nanoseconds>(pattern.until_change(at), 10s - at);
    EXPECT_GT(step, 0ns);
    EXPECT_EQ(pattern.lit(at), pattern.lit(at + step - 1ns)) << "changed before it said";
    if (pattern.lit(at) != last) ++w.changes;
    last = pattern.lit(at);
    if (last) w.lit += std::chrono::duration<double>(step).count() / 10;
    at += step;
  }
  return w;
}

TEST(LampPattern, TheFourStatesAreToldApart) {
  EXPECT_EQ(walk(LampState::recording).changes, 0);
  EXPECT_DOUBLE_EQ(walk(LampState::recording).lit, 1);
  EXPECT_LT(walk(LampState::idle).lit, 0.1);
  EXPECT_GT(walk(LampState::idle).changes, 0);
  EXPECT_NEAR(walk(LampState::done).lit, 0.5, 0.05);
  EXPECT_NEAR(walk(LampState::error).lit, 0.5, 0.05);
  EXPECT_GT(walk(LampState::error).changes, 4 * walk(LampState::done).changes);
}

// What a lamp was told, in order.
class Told {
 public:
  LightSwitch light() {
    return [this](bool lit) {
      lit_ = lit;
      ++(lit ? ons_ : offs_);
    };
  }
  [[nodiscard]] bool becomes(bool lit, std::chrono::milliseconds within = 5s) const {
    return waits([&] { return lit_ == lit; }, within);
  }
  [[nodiscard]] bool blinks() const {
    const int on = ons_, off = offs_;
    return waits([&] { return ons_ >= on + 3 && offs_ >= off + 3; }, 20s);
  }

 private:
  template <typename Done>
  static bool waits(Done done, std::chrono::milliseconds within) {
    const auto until = std::chrono::steady_clock::now() + within;
    while (!done() && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(1ms);
    return done();
  }
  std::atomic<bool> lit_ = false;
  std::atomic<int> ons_ = 0, offs_ = 0;
};

TEST(Lamp, ShowsEachStateAtOnceAndGoesOutAtTheEnd) {
  Told one, two;
  {
    Lamp lamp({one.light(), two.light()});
    lamp.set(LampState::recording);
    EXPECT_TRUE(one.becomes(true));
    EXPECT_TRUE(two.becomes(true));
    lamp.set(LampState::error);
    EXPECT_TRUE(one.blinks());
    lamp.set(LampState::recording);
    EXPECT_TRUE(one.becomes(true));
  }
  EXPECT_TRUE(one.becomes(false, 0ms));
  EXPECT_TRUE(two.becomes(false, 0ms));
}

TEST(Lamp, LightsTheKernelsLamp) {
  const test::TemporaryFolder leds;
  const auto led = leds / "rig:green:status";
  std::filesystem::create_directories(led);
  std::ofstream(led / "max_brightness") << "255\n";
  std::ofstream(led / "brightness") << "7\n";
  std::ofstream(led / "trigger") << "[heartbeat]";
  const auto content = [&](const char* name) {
    std::ifstream in(led / name);
    std::string text;
    in >> text;
    return text;
  };
  const LightSwitch light = led_switch("rig:green:status", leds.path());
  EXPECT_EQ(content("brightness"), "0");
  EXPECT_EQ(content("trigger"), "none");
  light(true);
  EXPECT_EQ(content("brightness"), "255");
  light(false);
  EXPECT_EQ(content("brightness"), "0");
  std::filesystem::remove_all(led);
  light(true);  // unplugged: no error
}

TEST(Lamp, ALampThatIsNotThereIsNamed) {
  const test::TemporaryFolder leds;
  EXPECT_TRUE(test::contains(test::input_error_of([&] { (void)led_switch("blue", leds.path()); }), "blue: is no lamp"));
  EXPECT_TRUE(test::contains(test::input_error_of([&] { (void)led_switch("..", leds.path()); }), "is no lamp"));
}

}  // namespace
}  // namespace mf
