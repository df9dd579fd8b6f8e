// SPDX-License-Identifier: Apache-2.0
// The program on a virtual screen, driven by a pointer and keys, judged by the pixels that the screen shows.
#include <gtest/gtest.h>

#include "host/viewer/layout.h"
#include "tests/host/viewer/viewer_session.h"
#include "tests/support/run_command.h"
#include "tests/support/virtual_display.h"

namespace mf {
namespace {

using Eigen::Vector2d;
using test::VirtualDisplay;

const char* const mirrorfield = MF_BINARY_DIR "/mirrorfield";
constexpr int width = 1000, height = 700;

// Yellow pixels: the dots of caught directions, and the cross on the plane.
int yellow(const ImageU8& screen, int from_x, int to_x) {
  int count = 0;
  for (int y = 0; y < height; ++y)
    for (int x = from_x; x < to_x; ++x)
      count += screen.at(x, y, 0) == 255 && screen.at(x, y, 1) == 220 && screen.at(x, y, 2) == 0;
  return count;
}

class SessionWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!VirtualDisplay::is_there()) GTEST_SKIP() << "Xvfb or xdotool is not installed";
  }
  const test::TemporaryFolder folder_;
};

// Mirrors at the left catch light at the left of the table only: at the right no dot is left.
TEST_F(SessionWindow, ShowsTheDirectionsCaughtUnderThePointer) {
  test::write_session(folder_ / "s", test::looking_down({{-0.1, 0}, {-0.1, 0.04}, {-0.1, -0.04}, {0.2, 0}}));
  const VirtualDisplay display(width, height);
  const test::ChildProcess program({mirrorfield, "view", folder_ / "s", "--size", "1000", "700"});
  const Box room = picture_room(width, height);
  const int disc_from = room.x + room.width / 2;
  // The left half of the room holds the plane: most views pass its left part.
  const auto dots = [&](const ImageU8& s) { return yellow(s, disc_from, width); };
  const auto cross = [&](const ImageU8& s) { return yellow(s, room.x, disc_from); };
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return cross(s) > 10; })) << "no picture came up";
  const double middle_y = caption_height_px + (height - caption_height_px - 8) / 2.0;
  const auto on_plane = [&](double fraction) { return Vector2d(room.x + fraction * (room.width / 2 - 8), middle_y); };
  display.click(on_plane(0.2));
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return dots(s) >= 10; })) << dots(display.screen());
  display.click(on_plane(0.55));
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return dots(s) == 0; })) << dots(display.screen());
}

TEST_F(SessionWindow, NamesWhatASessionLacks) {
  Calibration calibration = test::looking_down({{0, 0}});
  calibration.cam_from_world.reset();
  test::write_session(folder_ / "no_world", calibration);
  test::write_session(folder_ / "no_frame", test::looking_down({}));
  test::write_session(folder_ / "uncalibrated", calibration);
  std::filesystem::remove(folder_ / "uncalibrated" / "calibration.json");
  for (const auto& [session, word] : {std::pair{"no_world", "cam_from_world"},
                                      {"no_frame", "has no used frame"},
                                      {"uncalibrated", "mirrorfield calibrate"}}) {
    const test::CommandOutcome outcome = test::run_command({mirrorfield, "view", folder_ / session});
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
  }
  test::write_session(folder_ / "good", test::looking_down({{0, 0}, {0.1, 0}}));
  for (const std::vector<std::string>& what :
       {std::vector<std::string>{folder_ / "good", "--height", "300"}, {"--session", folder_ / "uncalibrated"}}) {
    std::vector<std::string> command{mirrorfield, "view"};
    command.insert(command.end(), what.begin(), what.end());
    const test::CommandOutcome outcome = test::run_command(command);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find("calibration.json"), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace mf
