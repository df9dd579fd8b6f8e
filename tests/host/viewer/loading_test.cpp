// SPDX-License-Identifier: Apache-2.0
// The work runs in its own thread here as there: it looks at the virtual screen itself.
#include "host/viewer/loading.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "common/error.h"
#include "host/viewer/layout.h"
#include "tests/support/virtual_display.h"

namespace mf {
namespace {

using namespace std::chrono_literals;
using test::VirtualDisplay;

constexpr int width = 1000, height = 700;

void wait_until_called_off(const Progress& progress) {
  for (;;) {
    progress("waiting", 0.5);
    std::this_thread::sleep_for(1ms);
  }
}

TEST(Loading, EndsWithItsWork) {
  int result = 0;
  Loading loading([&](const Progress&) { result = 7; });
  EXPECT_TRUE(loading.ends_within(30s));
  EXPECT_TRUE(loading.ends_within(0s));
  EXPECT_EQ(result, 7);
}

TEST(Loading, ThrowsWhatItsWorkThrew) {
  Loading loading([](const Progress&) { throw InputError("f", "", "is damaged"); });
  EXPECT_THROW((void)loading.ends_within(30s), InputError);
  Loading called_off([](const Progress&) { throw InputError("f", "", "is damaged"); });
  EXPECT_THROW(called_off.call_off(), InputError);
}

TEST(Loading, IsCalledOffWhereItReports) {
  Loading loading(wait_until_called_off);
  EXPECT_FALSE(loading.ends_within(20ms));
  EXPECT_EQ(loading.stage(), "waiting, 50 %");
  loading.call_off();
  EXPECT_TRUE(loading.ends_within(0s));
  const Loading ends_by_going(wait_until_called_off);
}

class LoadingWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!VirtualDisplay::is_there()) GTEST_SKIP() << "Xvfb or xdotool is not installed";
  }
};

// The word in the middle of where the picture will be, and something in the panel.
bool shows_text(const ImageU8& screen) {
  const Box room = picture_room(width, height);
  const auto bright = [&](int x0, int y0, int x1, int y1) {
    int count = 0;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) count += screen.at(x, y, 1) > 200;
    return count;
  };
  const int x = room.x + room.width / 2, y = room.y + room.height / 2;
  return bright(x, y - caption_height_px, x + 80, y) > 30 && bright(0, 0, panel_width_px, 60) > 30;
}

TEST_F(LoadingWindow, SaysThatItLoads) {
  const VirtualDisplay display(width, height);
  Window window("loading", width, height);
  std::atomic<bool> seen = false;
  Loading loading([&](const Progress& progress) {
    progress("reading", 0.25);
    seen = display.becomes(shows_text);
  });
  EXPECT_TRUE(show_loading(window, loading, "a light field"));
  EXPECT_TRUE(seen);
}

TEST_F(LoadingWindow, ClosesWhileItLoads) {
  const VirtualDisplay display(width, height);
  Window window("loading", width, height);
  Loading loading([&](const Progress& progress) {
    if (display.becomes(shows_text)) display.press("ctrl+q");
    wait_until_called_off(progress);
  });
  EXPECT_FALSE(show_loading(window, loading, "a light field"));
}

TEST_F(LoadingWindow, ShowsWhyItFailedUntilItIsClosed) {
  const VirtualDisplay display(width, height);
  Window window("loading", width, height);
  std::atomic<bool> seen = false;
  std::atomic<bool> failed = false;
  Loading loading([&](const Progress&) {
    (void)display.becomes(shows_text);
    failed = true;
    throw InputError("f.lf.exr", "", "is damaged: resample again");
  });
  std::thread hand([&] {
    while (!failed) std::this_thread::sleep_for(1ms);
    std::this_thread::sleep_for(500ms);  // it would have closed by then if it closed by itself
    seen = display.becomes(shows_text);
    display.press("ctrl+q");
  });
  EXPECT_THROW((void)show_loading(window, loading, "a light field"), InputError);
  hand.join();
  EXPECT_TRUE(seen);
}

}  // namespace
}  // namespace mf
