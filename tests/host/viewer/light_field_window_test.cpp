// SPDX-License-Identifier: Apache-2.0
// The program on a virtual screen, driven by a pointer and keys, judged by the pixels that the screen shows.
#include <gtest/gtest.h>

#include "host/io/image_file.h"
#include "host/viewer/layout.h"
#include "tests/host/viewer/viewer_fields.h"
#include "tests/support/run_command.h"
#include "tests/support/virtual_display.h"

namespace mf {
namespace {

using Eigen::Vector2d;
using test::colour_at;
using test::VirtualDisplay;

const char* const mirrorfield = MF_BINARY_DIR "/mirrorfield";
constexpr int width = 1000, height = 700;

class LightFieldWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!VirtualDisplay::is_there()) GTEST_SKIP() << "Xvfb or xdotool is not installed";
    write_light_field(field_, test::lamp_field());
  }

  const test::TemporaryFolder folder_;
  const std::string field_ = folder_ / "lamp.lf.exr";
  const LightFieldLayout layout_ = light_field_layout(width, height, 1);
  const Vector2d lamp_on_disc_ = layout_.hemisphere.pixel_of(equal_area_square({0.6F, 0, 0.8F}).cast<double>());
  const std::vector<std::string> command_{mirrorfield, "view", field_,          "--size",
                                          "1000",      "700",  "--screenshots", folder_.path()};
};

TEST_F(LightFieldWindow, ADragOnThePlaneMovesTheProbe) {
  const VirtualDisplay display(width, height);
  test::ChildProcess program(command_);
  // The lamp is red on the disc, the rest is blue; the plane is twice as red at the right.
  const auto lamp_red = [&](const ImageU8& screen) { return colour_at(screen, lamp_on_disc_).x(); };
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return lamp_red(s) > 100; })) << "no picture came up";
  const ImageU8 first = display.screen();
  EXPECT_EQ(colour_at(first, layout_.hemisphere.pixel_of({0.2, 0.5})).x(), 0);
  EXPECT_GT(colour_at(first, layout_.hemisphere.pixel_of({0.2, 0.5})).z(), 30);
  EXPECT_GT(colour_at(first, layout_.plane.pixel_of({0.95, 0.5})).x(),
            colour_at(first, layout_.plane.pixel_of({0.05, 0.5})).x() + 40);

  const int red_in_the_middle = lamp_red(first);
  display.click(layout_.plane.pixel_of({0.02, 0.5}));
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return lamp_red(s) < red_in_the_middle - 25; }))
      << red_in_the_middle << " became " << lamp_red(display.screen());
  const int red_at_the_left = lamp_red(display.screen());
  // Beyond the edge the probe stops at it.
  display.drag(
      {layout_.plane.pixel_of({0.02, 0.5}), layout_.plane.pixel_of({0.6, 0.4}), layout_.plane.pixel_of({1.04, 0.3})});
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return lamp_red(s) >= 254; }))
      << red_at_the_left << " became " << lamp_red(display.screen());
  EXPECT_EQ(colour_at(display.screen(), layout_.plane.pixel_of({1, 0.3}) + Vector2d(5, 0)),
            Eigen::Vector3i(255, 220, 0));
}

TEST_F(LightFieldWindow, TheExposureSliderBrightensEveryPicture) {
  const VirtualDisplay display(width, height);
  test::ChildProcess program(command_);
  const Vector2d dim = layout_.hemisphere.pixel_of({0.2, 0.5});
  const Vector2d panorama = layout_.panorama.pixel_of({0.25, 0.3}), plane = layout_.plane.pixel_of({0.1, 0.3});
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return colour_at(s, panorama).z() > 0; }));
  const ImageU8 before = display.screen();
  const Vector2d slider(98, 18);  // the first row of the panel; its middle is 0 stops
  display.drag({slider, slider + Vector2d(30, 0)});
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) {
    return colour_at(s, dim).z() > colour_at(before, dim).z() + 20 &&
           colour_at(s, panorama).z() > colour_at(before, panorama).z() + 20 &&
           colour_at(s, plane).z() > colour_at(before, plane).z() + 20;
  }));
}

TEST_F(LightFieldWindow, AScreenshotIsWhatTheScreenShows) {
  const VirtualDisplay display(width, height);
  test::ChildProcess program(command_);
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return colour_at(s, lamp_on_disc_).x() > 100; }));
  display.point_at({panel_width_px / 2.0, height / 2.0});  // the arrow is on the screen only
  const std::filesystem::path file = folder_ / "view_0001.png";
  display.press("F12");
  ASSERT_TRUE(display.becomes([&](const ImageU8&) { return std::filesystem::exists(file); }));
  const ImageU16 shot = std::get<ImageU16>(read_image(file));
  const ImageU8 screen = display.screen();
  ASSERT_EQ(shot.width, width);
  ASSERT_EQ(shot.height, height);
  // Without the panel: there the screen now tells of the screenshot.
  for (int y = 0; y < height; y += 3)
    for (int x = panel_width_px; x < width; x += 3)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(shot.at(x, y, c), screen.at(x, y, c)) << x << ' ' << y;
  display.press("ctrl+q");
  EXPECT_EQ(program.wait(), 0);
}

TEST_F(LightFieldWindow, NamesAFileThatIsNone) {
  const test::CommandOutcome outcome = test::run_command({mirrorfield, "view", folder_ / "missing.lf.exr"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
  EXPECT_NE(outcome.err.find("missing.lf.exr"), std::string::npos);
}

TEST_F(LightFieldWindow, NamesTheDisplayThatIsMissing) {
  for (const char* display : {"DISPLAY=", "DISPLAY=:987"}) {
    const test::CommandOutcome outcome =
        test::run_command({"env", "-u", "WAYLAND_DISPLAY", display, mirrorfield, "view", field_});
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find("display"), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace mf
