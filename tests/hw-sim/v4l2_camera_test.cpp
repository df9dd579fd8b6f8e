// SPDX-License-Identifier: Apache-2.0
// The simulated camera against v4l2-ctl, which is none of ours.
#include "hw-sim/v4l2_camera.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <vector>

#include "common/file_bytes.h"
#include "tests/hw-sim/v4l2_rig.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using test::contains;

class V4l2Ctl : public testing::Test {
 protected:
  void SetUp() override {
    if (!sim::has_umockdev()) GTEST_SKIP() << "needs umockdev's preload library";
    if (!test::has_program("v4l2-ctl")) GTEST_SKIP() << "needs v4l2-ctl";
  }
  static test::CommandOutcome v4l2_ctl(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"v4l2-ctl", "-d", "/dev/video60"});
    return test::run_command(arguments);
  }
};

TEST_F(V4l2Ctl, SeesTheCameraAsItIs) {
  const test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_SRGGB12));
  const test::CommandOutcome all = v4l2_ctl({"--all"});
  EXPECT_EQ(all.exit_code, 0) << all.err;
  for (const char* part : {"Mirrorfield camera", "Width/Height      : 64/48", "'RG12'", "Frames per second: 100.000",
                           "auto_exposure", "wide_dynamic_range", "hdr_sensor_mode", "crop, Left 0, Top 0, Width 64"})
    EXPECT_TRUE(contains(all.out, part));
}

TEST_F(V4l2Ctl, WritesControlsThatItReadsBack) {
  const test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y12));
  EXPECT_NE(v4l2_ctl({"-c", "exposure_time_absolute=55"}).err, "") << "it is inactive under automatic exposure";
  EXPECT_EQ(v4l2_ctl({"-c", "auto_exposure=1"}).exit_code, 0);
  EXPECT_EQ(v4l2_ctl({"-c", "exposure_time_absolute=55,wide_dynamic_range=1,hdr_sensor_mode=2"}).err, "");
  const std::string out = v4l2_ctl({"-C", "exposure_time_absolute,wide_dynamic_range,hdr_sensor_mode"}).out;
  EXPECT_TRUE(contains(out, "exposure_time_absolute: 55"));
  EXPECT_TRUE(contains(out, "wide_dynamic_range: 1"));
  EXPECT_TRUE(contains(out, "hdr_sensor_mode: 2"));
}

TEST_F(V4l2Ctl, StreamsExactlyTheFramesThatAreServed) {
  const test::TemporaryFolder folder;
  const test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y16));
  const std::string file = (folder / "frames.raw").string();
  const test::CommandOutcome run = v4l2_ctl({"--stream-mmap=4", "--stream-count=20", "--stream-to=" + file});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string bytes = read_file_bytes(file);
  constexpr std::size_t each = 64 * 48 * 2;
  ASSERT_EQ(bytes.size(), 20 * each);
  std::vector<std::uint8_t> expected(each);
  sim::V4l2Mode mode;
  mode.fourcc = V4L2_PIX_FMT_Y16;
  mode.width = 64;
  mode.height = 48;
  mode.bytes_per_line = 128;
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < 20; ++i) {
    // A busy machine may make v4l2-ctl miss some: numbers go up, and each frame is whole.
    bool found = false;
    for (++number; number < 1000 && !found; number += found ? 0 : 1) {
      test::fill_pattern(number, mode, expected);
      found = std::equal(expected.begin(), expected.end(), bytes.begin() + static_cast<std::ptrdiff_t>(i * each),
                         [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); });
    }
    ASSERT_TRUE(found) << "frame " << i << " of the file is none of the camera's";
  }
}

TEST_F(V4l2Ctl, DoesNotFindAnUnpluggedCamera) {
  test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_GREY));
  rig.camera.unplug();
  EXPECT_NE(v4l2_ctl({"--all"}).exit_code, 0);
  rig.camera.replug();
  EXPECT_EQ(v4l2_ctl({"--all"}).exit_code, 0);
}

TEST_F(V4l2Ctl, KilledWhileItStreamsItLeavesTheCameraToOthers) {
  const test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_GREY));
  for (int i = 0; i < 3; ++i) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      ::execlp("v4l2-ctl", "v4l2-ctl", "-d", "/dev/video60", "--stream-mmap", "--stream-to=/dev/null", nullptr);
      ::_exit(127);
    }
    const std::int64_t before = rig.camera.counts().frames;
    for (int wait = 0; wait < 500 && rig.camera.counts().frames < before + 5; ++wait) ::usleep(10'000);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    EXPECT_GE(rig.camera.counts().frames, before + 5);
    for (int wait = 0; wait < 200 && rig.camera.counts().streaming; ++wait) ::usleep(10'000);
    EXPECT_FALSE(rig.camera.counts().streaming);
  }
}

TEST(V4l2Camera, OptionsThatMakeNoCameraAreRefused) {
  sim::V4l2CameraOptions options = test::pattern_camera(V4L2_PIX_FMT_GREY);
  options.width = 63;
  const auto error = [&] {
    return test::input_error_of([&] { sim::V4l2Camera(nullptr, options, test::fill_pattern); });
  };
  EXPECT_TRUE(contains(error(), "width, height"));
  options = test::pattern_camera(V4L2_PIX_FMT_GREY);
  options.fourccs.clear();
  EXPECT_TRUE(contains(error(), "fourccs"));
}

}  // namespace
}  // namespace mf
