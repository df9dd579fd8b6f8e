// SPDX-License-Identifier: Apache-2.0
// The program on a virtual screen, driven by a pointer and keys, judged by the pixels that the screen shows. What a
// camera truly sees of the wall is known at every place (viewer_photos.h).
#include <gtest/gtest.h>

#include <cmath>

#include "host/lumigraph/camera_path.h"
#include "host/lumigraph/lumigraph.h"
#include "host/viewer/layout.h"
#include "tests/host/viewer/viewer_photos.h"
#include "tests/support/run_command.h"
#include "tests/support/virtual_display.h"

namespace mf {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;
using test::colour_at;
using test::VirtualDisplay;

const char* const mirrorfield = MF_BINARY_DIR "/mirrorfield";
constexpr int width = 1000, height = 700;

Vector3i colour_of_photo(std::uint32_t photo) {
  const auto colour = field_colour(photo);
  return {colour[0], colour[1], colour[2]};
}

class LumigraphWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!VirtualDisplay::is_there()) GTEST_SKIP() << "Xvfb or xdotool is not installed";
    test::write_wall_photos(folder_.path());
  }

  // How far the shown picture is from what a camera at (x, 0, 0) sees, codes: the mean over the picture's middle.
  [[nodiscard]] double difference_from(const ImageU8& screen, double camera_x) const {
    double sum = 0;
    int count = 0;
    for (double v = 0.25; v < 0.76; v += 0.05)
      for (double u = 0.25; u < 0.76; u += 0.05, ++count) {
        const Vector2d pixel = box_.pixel_of({u, v}).array().floor() + 0.5;
        const View view = test::view_from(camera_x);
        const Vector2d in_photo = box_.position_of(pixel).cwiseProduct(Vector2d(view.camera.width, view.camera.height));
        sum += (colour_at(screen, pixel).cast<double>() - test::wall_seen(view, in_photo)).cwiseAbs().mean();
      }
    return sum / count;
  }

  // The lowest square of the panel in a photo's colour: the one of the photos' list.
  [[nodiscard]] static std::optional<Vector2d> in_list(const ImageU8& screen, std::uint32_t photo) {
    for (int y = height - 1; y >= 0; --y)
      for (int x = 0; x < panel_width_px; ++x)
        if (colour_at(screen, Vector2d(x, y)) == colour_of_photo(photo)) return Vector2d(x, y);
    return std::nullopt;
  }

  // Pixels of the panel in a photo's colour.
  [[nodiscard]] static int count_in_panel(const ImageU8& screen, std::uint32_t photo) {
    int count = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < panel_width_px; ++x) count += colour_at(screen, Vector2d(x, y)) == colour_of_photo(photo);
    return count;
  }

  const test::TemporaryFolder folder_;
  const Box box_ = fitted(picture_room(width, height), 160.0 / 120);
  const std::vector<std::string> command_{mirrorfield, "view",    "--transforms",  folder_ / "transforms.json",
                                          "--proxy",   "plane:3", "--size",        "1000",
                                          "700",       "--path",  folder_ / "path"};
};

TEST_F(LumigraphWindow, AClickInTheListGoesToThatPhoto) {
  const VirtualDisplay display(width, height);
  const test::ChildProcess program(command_);
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return difference_from(s, 0) < 3; })) << "no picture came up";
  EXPECT_GT(difference_from(display.screen(), test::wall_photo_x(4)), 20);
  const auto row = in_list(display.screen(), 4);
  ASSERT_TRUE(row);
  display.click(*row + Vector2d(40, -5));
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return difference_from(s, test::wall_photo_x(4)) < 3; }))
      << difference_from(display.screen(), test::wall_photo_x(4));
}

TEST_F(LumigraphWindow, TheCheckboxShowsTheBlendingFieldInThePhotosColours) {
  const VirtualDisplay display(width, height);
  const test::ChildProcess program(command_);
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return difference_from(s, 0) < 3; }));
  display.click({18, 18});  // the first row of the panel
  const auto is_colour_of = [&](const ImageU8& s, std::uint32_t photo) {
    return (colour_at(s, box_.pixel_of({0.5, 0.4})) - colour_of_photo(photo)).cwiseAbs().maxCoeff() <= 4;
  };
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return is_colour_of(s, 2); }));
  const auto row = in_list(display.screen(), 1);
  ASSERT_TRUE(row);
  display.click(*row + Vector2d(40, -5));
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return is_colour_of(s, 1); }));
  display.press("b");
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return difference_from(s, test::wall_photo_x(1)) < 3; }));
}

TEST_F(LumigraphWindow, TellsWhoSpeaksUnderThePointer) {
  const VirtualDisplay display(width, height);
  const test::ChildProcess program(command_);
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return difference_from(s, 0) < 3; }));
  display.point_at({panel_width_px / 2.0, 300});
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return count_in_panel(s, 2) > 0; }));
  const int in_the_list = count_in_panel(display.screen(), 2);
  const int of_another = count_in_panel(display.screen(), 0);
  display.point_at(box_.pixel_of({0.5, 0.5}));
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return count_in_panel(s, 2) >= 2 * in_the_list; }));
  EXPECT_EQ(count_in_panel(display.screen(), 0), of_another);
}

TEST_F(LumigraphWindow, OrbitsAboutTheMiddleAndFocusesWithTheWheel) {
  const VirtualDisplay display(width, height);
  const test::ChildProcess program(command_);
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return difference_from(s, 0) < 3; }));
  const Vector2d middle = box_.pixel_of({0.5, 0.5});
  const Vector3i before = colour_at(display.screen(), middle);
  display.drag({box_.pixel_of({0.5, 0.6}), box_.pixel_of({0.6, 0.6}), box_.pixel_of({0.7, 0.6})});
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return difference_from(s, 0) > 5; }));
  EXPECT_LT((colour_at(display.screen(), middle) - before).cwiseAbs().maxCoeff(), 8);

  const ImageU8 sharp = display.screen();
  display.point_at(box_.pixel_of({0.5, 0.6}));
  display.hold_key("shift");
  for (int i = 0; i < 6; ++i) display.scroll(VirtualDisplay::Wheel::up);
  const auto changed = [&](const ImageU8& s) {
    double sum = 0;
    for (int y = box_.y; y < box_.y + box_.height; y += 10)
      for (int x = box_.x; x < box_.x + box_.width; x += 10)
        sum += (colour_at(s, Vector2d(x, y)) - colour_at(sharp, Vector2d(x, y))).cwiseAbs().maxCoeff() > 8 ? 1 : 0;
    return sum;
  };
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return changed(s) > 50; })) << "the wheel changed nothing";
  display.release_key("shift");
}

TEST_F(LumigraphWindow, FliesWhileAKeyIsHeldAndRecordsAPath) {
  const VirtualDisplay display(width, height);
  const test::ChildProcess program(command_);
  ASSERT_TRUE(display.becomes([&](const ImageU8& s) { return difference_from(s, 0) < 3; }));
  display.point_at(box_.pixel_of({0.5, 0.5}));
  display.press("k");
  display.hold_key("d");
  EXPECT_TRUE(display.becomes([&](const ImageU8& s) { return difference_from(s, 0) > 8; }));
  display.release_key("d");
  display.press("k");
  display.press("r");
  const fs::path last = folder_ / "path/frames/0031.png";
  ASSERT_TRUE(display.becomes([&](const ImageU8&) { return fs::exists(last); })) << "the path was not rendered";
  const std::vector<View> path = read_camera_path(folder_ / "path/path.json");
  ASSERT_EQ(path.size(), 31U);
  const View &first_view = path.front(), &last_view = path.back();
  EXPECT_LT(first_view.cam_from_world.inverse().translation.norm(), 1e-6);
  const Vector3d end = last_view.cam_from_world.inverse().translation;
  EXPECT_GT(end.x(), 0.02);
  EXPECT_LT(std::hypot(end.y(), end.z()), 1e-6);
  EXPECT_EQ(std::get<ImageU16>(read_image(last)).width, 160);  // the photos' own width: the window is larger
  // Every frame is what that view sees.
  const FramePixels pixels = read_image(folder_ / "path/frames/0001.png");
  const auto& frame = std::get<ImageU16>(pixels);
  const Vector3d truth = test::wall_seen(first_view, {frame.width / 2 + 0.5, frame.height / 3 + 0.5});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(frame.at(frame.width / 2, frame.height / 3, c), truth[c], 4);
}

TEST_F(LumigraphWindow, NamesWhatItCannotShow) {
  const auto error = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {mirrorfield, "view"});
    const test::CommandOutcome outcome = test::run_command(arguments);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    return outcome.err;
  };
  EXPECT_NE(error({}).find("needs one thing to show"), std::string::npos);
  EXPECT_NE(
      error({"--transforms", folder_ / "transforms.json", "--scene"}).find("--scene: is for a session's pictures"),
      std::string::npos);
  EXPECT_NE(error({"--transforms", folder_ / "none.json"}).find("none.json"), std::string::npos);
  EXPECT_NE(error({"--transforms", folder_ / "transforms.json", "--proxy", "cone"}).find("cone"), std::string::npos);
  EXPECT_NE(error({"--transforms", folder_ / "transforms.json", "--scale", "2"}).find("--scale"), std::string::npos);
}

}  // namespace
}  // namespace mf
