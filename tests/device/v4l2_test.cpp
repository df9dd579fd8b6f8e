// SPDX-License-Identifier: Apache-2.0
// The V4L2 source against the simulated camera: real ioctls and mapped buffers, through umockdev.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <thread>

#include "device/capture.h"
#include "device/clock.h"
#include "device/v4l2_controls.h"
#include "device/v4l2_source.h"
#include "tests/device/scripted_camera.h"
#include "tests/hw-sim/v4l2_rig.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/full_counts.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using std::chrono::milliseconds;
using test::contains;
using test::input_error_of;
using test::V4l2Rig;

class V4l2Source : public testing::Test {
 protected:
  void SetUp() override {
    if (!sim::has_umockdev()) GTEST_SKIP() << "needs umockdev's preload library";
  }
};

// The next frame, damaged or not; gives up after some seconds.
Received next_of(CameraSource& source, CameraFrame& frame) {
  frame.codes = ImageU16(source.description().width, source.description().height, 1);
  Received received = Received::nothing;
  for (int i = 0; i < 50 && received == Received::nothing; ++i) received = source.receive(frame, milliseconds(100));
  return received;
}

std::string refusal(const CameraSettings& settings) {
  return input_error_of([&] { (void)open_v4l2_source(settings); });
}

// Records until `frames` are durable.
CaptureResult record(const std::filesystem::path& session, const CameraSettings& settings, std::int64_t frames,
                     const std::function<void(const std::atomic<bool>&)>& meanwhile = {}) {
  std::atomic<bool> stop = false;
  std::thread watch([&] {
    if (meanwhile) meanwhile(stop);
    for (int i = 0; i < 1000 && !std::filesystem::exists(session / fmt::format("frames/{:06}.tif", frames - 1)); ++i)
      std::this_thread::sleep_for(milliseconds(10));
    stop = true;
  });
  CaptureOptions options;
  options.most_seconds = 240;
  CaptureResult result =
      capture([=] { return open_v4l2_source(settings); }, session, test::header_with_target(), options, stop);
  watch.join();
  return result;
}

struct FormatCase {
  const char* name;
  std::uint32_t fourcc;
  PixelFormat format;
  std::uint32_t alignment = 1;
};

class V4l2Recording : public V4l2Source, public testing::WithParamInterface<FormatCase> {
 protected:
  // A camera that starts in a format which cannot be recorded, so that the one asked for must be set.
  [[nodiscard]] static sim::V4l2CameraOptions camera() {
    sim::V4l2CameraOptions options = test::pattern_camera(GetParam().fourcc);
    options.fourccs = {V4L2_PIX_FMT_MJPEG, GetParam().fourcc};
    options.line_alignment_bytes = GetParam().alignment;
    return options;
  }
  [[nodiscard]] static CameraSettings settings() {
    CameraSettings settings = test::settings_for_rig();
    settings.pixel_format = GetParam().name;
    return settings;
  }
};
class V4l2Unpacking : public V4l2Recording {};

TEST_P(V4l2Recording, IsBitForBitInTheSession) {
  const test::TemporaryFolder folder;
  const V4l2Rig rig(camera());
  const CaptureResult result = record(folder / "s", settings(), 12);
  EXPECT_GE(result.recorder.durable, 12);
  const SessionReader reader(folder / "s");
  EXPECT_EQ(reader.header().format, GetParam().format);
  for (const SessionFrame& frame : reader.frames()) {
    const ImageU16 codes = std::get<ImageU16>(reader.read_frame(frame).pixels);
    const auto number = static_cast<std::uint64_t>(frame.arrival.value().device_frame);
    EXPECT_EQ(test::wrong_pixels(codes, GetParam().format.bits, number), 0) << "frame " << number;
  }
}

TEST_P(V4l2Unpacking, IsBitForBit) {
  const V4l2Rig rig(camera());
  const std::unique_ptr<CameraSource> source = open_v4l2_source(settings());
  EXPECT_EQ(source->description().format, GetParam().format);
  source->start();
  CameraFrame frame;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(next_of(*source, frame), Received::frame);
    const auto number = static_cast<std::uint64_t>(frame.arrival.device_frame);
    EXPECT_EQ(test::wrong_pixels(frame.codes, GetParam().format.bits, number), 0) << "frame " << number;
  }
}

using enum PixelLayout;
const auto case_name = [](const auto& tested) { return fmt::format("{}_{}", tested.param.name, tested.index); };
INSTANTIATE_TEST_SUITE_P(V4l2, V4l2Recording,
                         testing::Values(FormatCase{"Mono8", V4L2_PIX_FMT_GREY, {mono, 8}},
                                         FormatCase{"Mono10", V4L2_PIX_FMT_Y10, {mono, 10}},
                                         FormatCase{"Mono12", V4L2_PIX_FMT_Y12, {mono, 12}, 256},
                                         FormatCase{"Mono16", V4L2_PIX_FMT_Y16, {mono, 16}},
                                         FormatCase{"BayerRG8", V4L2_PIX_FMT_SRGGB8, {bayer_rg, 8}, 128},
                                         FormatCase{"BayerRG12", V4L2_PIX_FMT_SRGGB12, {bayer_rg, 12}}),
                         case_name);
INSTANTIATE_TEST_SUITE_P(V4l2, V4l2Unpacking,
                         testing::Values(FormatCase{"BayerGR8", V4L2_PIX_FMT_SGRBG8, {bayer_gr, 8}},
                                         FormatCase{"BayerGB8", V4L2_PIX_FMT_SGBRG8, {bayer_gb, 8}},
                                         FormatCase{"BayerBG8", V4L2_PIX_FMT_SBGGR8, {bayer_bg, 8}},
                                         FormatCase{"BayerGR12", V4L2_PIX_FMT_SGRBG12, {bayer_gr, 12}},
                                         FormatCase{"BayerGB12", V4L2_PIX_FMT_SGBRG12, {bayer_gb, 12}},
                                         FormatCase{"BayerBG12", V4L2_PIX_FMT_SBGGR12, {bayer_bg, 12}},
                                         FormatCase{"BayerRG10", V4L2_PIX_FMT_SRGGB10, {bayer_rg, 10}},
                                         FormatCase{"BayerRG10p", V4L2_PIX_FMT_SRGGB10P, {bayer_rg, 10}},
                                         FormatCase{"BayerRG12p", V4L2_PIX_FMT_SRGGB12P, {bayer_rg, 12}, 32},
                                         FormatCase{"BayerRG12", V4L2_PIX_FMT_SRGGB12P, {bayer_rg, 12}},  // is as good
                                         FormatCase{"Mono8", V4L2_PIX_FMT_YUYV, {mono, 8}}),
                         case_name);

TEST_F(V4l2Source, TakesTheBestFormatWhenNoneIsAskedFor) {
  sim::V4l2CameraOptions options = test::pattern_camera(V4L2_PIX_FMT_MJPEG);
  options.fourccs = {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y12, V4L2_PIX_FMT_Y10};
  {
    const V4l2Rig rig(options);
    EXPECT_EQ(open_v4l2_source(test::settings_for_rig())->description().wire_format, "Y12");
  }
  options.fourccs = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
  {
    const V4l2Rig rig(options);
    EXPECT_EQ(open_v4l2_source(test::settings_for_rig())->description().wire_format, "YUYV");
  }
  options.fourccs = {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y12};  // it is set to one that can be recorded: that stays
  const V4l2Rig rig(options);
  EXPECT_EQ(open_v4l2_source(test::settings_for_rig())->description().wire_format, "GREY");
}

TEST_F(V4l2Source, SettingsAreWrittenAndReadBack) {
  const V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_SRGGB12));
  CameraSettings settings = test::settings_for_rig();
  settings.region_px = std::array{16, 8, 32, 24};
  settings.exposure_s = 0.00123;
  settings.gain_db = 6.0;
  settings.gain_step_db = 0.3;
  settings.frame_rate_hz = 50;
  const std::unique_ptr<CameraSource> source = open_v4l2_source(settings);
  const CameraDescription& d = source->description();
  EXPECT_EQ(d.width, 32);
  EXPECT_EQ(d.height, 24);
  EXPECT_NEAR(d.exposure_s, 0.0012, 1e-9);  // the camera's step is 100 µs
  EXPECT_NEAR(d.gain_db, 6, 1e-9);
  EXPECT_NEAR(d.frame_rate_hz, 50, 1e-3);
  EXPECT_EQ(d.vendor, "Mirrorfield");
  EXPECT_EQ(d.model, "Mirrorfield camera");
  EXPECT_EQ(d.serial, "MF0001");
  source->start();
  CameraFrame frame;
  ASSERT_EQ(next_of(*source, frame), Received::frame);
  EXPECT_EQ(test::wrong_pixels(frame.codes, 12, static_cast<std::uint64_t>(frame.arrival.device_frame), 16, 8), 0);
  source->set_exposure_s(0.0205);  // while it runs
  EXPECT_NEAR(source->description().exposure_s, 0.0205, 1e-9);
}

TEST_F(V4l2Source, RefusedSettingsNameTheCameraTheFieldAndTheRemedy) {
  sim::V4l2CameraOptions options = test::pattern_camera(V4L2_PIX_FMT_Y12);
  options.fourccs.push_back(V4L2_PIX_FMT_MJPEG);
  const V4l2Rig rig(options);
  const auto with = [](auto&& change) {
    CameraSettings settings = test::settings_for_rig();
    change(settings);
    std::string error = refusal(settings);
    EXPECT_TRUE(contains(error, "/dev/video60: "));
    return error;
  };
  EXPECT_TRUE(contains(with([](auto& s) { s.pixel_format = "BayerRG12"; }), "the camera has: Mono12, MJPG"));
  EXPECT_TRUE(contains(with([](auto& s) { s.region_px = std::array{1, 0, 32, 24}; }), "takes [0, 0, 32, 24] instead"));
  EXPECT_TRUE(contains(with([](auto& s) { s.exposure_s = 2; }), "0.0001 to 1 s"));
  EXPECT_TRUE(contains(with([](auto& s) { s.gain_db = 3; }), "gain_step_db: is missing"));
  EXPECT_TRUE(contains(with([](auto& s) { s.frame_rate_hz = 400; }), "takes 120 instead of 400"));
}

TEST_F(V4l2Source, ACameraThatCannotCropTakesItsOwnSizeOnly) {
  sim::V4l2CameraOptions options = test::pattern_camera(V4L2_PIX_FMT_Y12);
  options.crops = false;
  const V4l2Rig rig(options);
  CameraSettings settings = test::settings_for_rig();
  settings.region_px = std::array{0, 0, 64, 48};
  EXPECT_EQ(open_v4l2_source(settings)->description().width, 64);
  settings.region_px = std::array{2, 0, 32, 48};
  EXPECT_TRUE(contains(refusal(settings), "cannot crop"));
  settings.region_px = std::array{0, 0, 32, 24};
  EXPECT_TRUE(contains(refusal(settings), "takes 64 x 48 pixels instead"));
}

TEST_F(V4l2Source, WhatCannotBeOpenedIsOneLineWithTheRemedy) {
  test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y12));
  const auto at = [](const std::string& address) {
    CameraSettings settings;
    settings.address = address;
    return refusal(settings);
  };
  EXPECT_TRUE(contains(at("/dev/video99"), "/dev/video99: address: cannot be opened (No such file or directory)"));
  EXPECT_TRUE(contains(at("/dev/null"), "it is no V4L2 camera"));
  rig.camera.occupy(true);
  EXPECT_TRUE(contains(at("/dev/video60"), "another program has the camera: `fuser -v /dev/video60`"));
}

TEST_F(V4l2Source, ASecondProgramIsToldThatTheCameraIsInUse) {
  const V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y12));
  const std::unique_ptr<CameraSource> first = open_v4l2_source(test::settings_for_rig());
  EXPECT_TRUE(contains(refusal(test::settings_for_rig()), "another program has the camera"));
}

// Root may open everything, so it becomes nobody in a child process.
TEST(V4l2Permission, IsNamedWithTheGroup) {
  if (::getuid() != 0) GTEST_SKIP() << "needs root to become another user";
  const test::TemporaryFolder folder;
  std::filesystem::permissions(folder.path(), std::filesystem::perms{0755});
  const std::string node = (folder / "video0").string();
  std::ofstream(node).close();
  std::filesystem::permissions(node, std::filesystem::perms{0600});
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    constexpr uid_t nobody = 65534;
    if (::setgid(nobody) != 0 || ::setuid(nobody) != 0) ::_exit(2);
    CameraSettings settings;
    settings.address = node;
    ::_exit(refusal(settings).find("group video") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST_F(V4l2Source, ClocksAndNumbersOfAFrame) {
  const V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y12));
  const std::unique_ptr<CameraSource> source = open_v4l2_source(test::settings_for_rig());
  source->start();
  const std::int64_t started = clock_ns(CLOCK_MONOTONIC);
  CameraFrame frame;
  ASSERT_EQ(next_of(*source, frame), Received::frame);
  EXPECT_EQ(frame.arrival.device_frame, 1);
  EXPECT_LT(std::abs(frame.arrival.device_ns - started), 5'000'000'000);
  std::this_thread::sleep_for(milliseconds(200));  // the second one has waited then: it came when it came
  ASSERT_EQ(next_of(*source, frame), Received::frame);
  EXPECT_EQ(frame.arrival.device_frame, 2);
  EXPECT_LT(std::abs(frame.arrival.monotonic_ns - frame.arrival.device_ns), 2'000);
  EXPECT_GT(clock_ns(CLOCK_MONOTONIC) - frame.arrival.monotonic_ns, 100'000'000);
  const std::int64_t clocks = clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC);
  EXPECT_LT(std::abs(frame.arrival.realtime_ns - frame.arrival.monotonic_ns - clocks), 50'000'000);
}

TEST_F(V4l2Source, AnUnknownClockIsNotTakenForOurs) {
  sim::V4l2CameraOptions options = test::pattern_camera(V4L2_PIX_FMT_Y12);
  options.monotonic_stamps = false;
  const V4l2Rig rig(options);
  const std::unique_ptr<CameraSource> source = open_v4l2_source(test::settings_for_rig());
  source->start();
  CameraFrame frame;
  ASSERT_EQ(next_of(*source, frame), Received::frame);
  EXPECT_LT(std::abs(frame.arrival.monotonic_ns - clock_ns(CLOCK_MONOTONIC)), 5'000'000'000);
  EXPECT_GT(frame.arrival.device_ns - frame.arrival.monotonic_ns, 3'000'000'000'000);  // an hour off, in the simulator
}

TEST_F(V4l2Source, DamagedAndShortFramesAreIncompleteAndAHungCameraGivesNothing) {
  test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y12));
  const std::unique_ptr<CameraSource> source = open_v4l2_source(test::settings_for_rig());
  rig.camera.add_faults({0, 1, 1});
  source->start();
  CameraFrame frame;
  EXPECT_EQ(next_of(*source, frame), Received::incomplete);
  EXPECT_EQ(frame.arrival.device_frame, 1);
  EXPECT_EQ(next_of(*source, frame), Received::incomplete);
  EXPECT_EQ(next_of(*source, frame), Received::frame);
  rig.camera.hang(true);
  Received received = Received::frame;
  for (int i = 0; i < 50 && received == Received::frame; ++i) received = source->receive(frame, milliseconds(100));
  EXPECT_EQ(received, Received::nothing);
  rig.camera.hang(false);
  EXPECT_EQ(next_of(*source, frame), Received::frame);
}

TEST_F(V4l2Source, GapsInTheSequenceAndDamagedFramesAreGapRows) {
  const test::TemporaryFolder folder;
  test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y12));
  const CaptureResult result = record(folder / "s", test::settings_for_rig(), 40, [&](const auto&) {
    for (int i = 0; i < 500 && rig.camera.counts().frames < 10; ++i) std::this_thread::sleep_for(milliseconds(10));
    rig.camera.add_faults({3, 0, 0});
    std::this_thread::sleep_for(milliseconds(100));
    rig.camera.add_faults({0, 1, 0});
  });
  const SessionReader reader(folder / "s");
  std::int64_t skipped = 0, damaged = 0;
  for (const FrameGap& gap : reader.gaps())
    (gap.reason.find("numbers") != std::string::npos ? skipped : damaged) += gap.missing;
  EXPECT_EQ(damaged, 1);
  EXPECT_GE(skipped, 3);
  EXPECT_LE(skipped, 3 + rig.camera.counts().without);  // more only when this machine was too busy
  EXPECT_EQ(result.recorder.lost, skipped + damaged);
}

TEST_F(V4l2Source, ControlsAreFeaturesUnderTheNamesOfV4l2Ctl) {
  const V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y12));
  CameraSettings settings = test::settings_for_rig();
  settings.exposure_s.reset();
  const std::unique_ptr<CameraSource> source = open_v4l2_source(settings);
  FeatureAccess& features = source->features();
  EXPECT_TRUE(features.has("wide_dynamic_range"));
  EXPECT_FALSE(features.has("exposure_time_absolute")) << "inactive under automatic exposure";
  EXPECT_FALSE(features.has("MultiSlopeMode"));
  features.set_number("wide_dynamic_range", 1);
  EXPECT_EQ(features.number("wide_dynamic_range"), 1);
  EXPECT_EQ(features.choice("hdr_sensor_mode"), "Off");
  features.set_choice("hdr_sensor_mode", "Two Slopes");
  EXPECT_EQ(features.choice("hdr_sensor_mode"), "Two Slopes");
  if (test::has_program("v4l2-ctl")) {
    EXPECT_TRUE(contains(test::run_command({"v4l2-ctl", "-d", "/dev/video60", "-C", "hdr_sensor_mode"}).out,
                         "hdr_sensor_mode: 1"));
  }
  EXPECT_TRUE(contains(input_error_of([&] { features.set_choice("hdr_sensor_mode", "On"); }),
                       "'On' is none of its entries: Off, Two Slopes, DOL"));
  EXPECT_TRUE(
      contains(input_error_of([&] { (void)features.number("gamma"); }), "/dev/video60: gamma: the camera has no"));
  EXPECT_TRUE(contains(input_error_of([&] { features.set_number("gain", 1000); }), "0 to 240"));
  EXPECT_TRUE(contains(input_error_of([&] { features.set_number("exposure_time_absolute", 20); }), "automatic"));
}

TEST(V4l2ControlName, IsMadeAsV4l2CtlDoes) {
  EXPECT_EQ(v4l2_control_name("Exposure Time, Absolute"), "exposure_time_absolute");
  EXPECT_EQ(v4l2_control_name("White Balance, Auto & Preset"), "white_balance_auto_preset");
  EXPECT_EQ(v4l2_control_name("HDR Sensor Mode"), "hdr_sensor_mode");
}

TEST_F(V4l2Source, CamerasAreFoundByTheirLastingName) {
  test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y12));
  const std::vector<FoundCamera> found = find_v4l2_cameras();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].name, "/dev/v4l/by-id/mirrorfield-MF0001-video-index0");
  EXPECT_EQ(found[0].address, "/dev/video60");
  EXPECT_EQ(found[0].serial, "MF0001");
  CameraSettings settings;
  EXPECT_EQ(open_v4l2_source(settings)->description().serial, "MF0001");  // the first found
  settings.address = found[0].name;
  EXPECT_EQ(open_v4l2_source(settings)->description().serial, "MF0001");
  rig.camera.unplug();
  EXPECT_TRUE(find_v4l2_cameras().empty());
  settings.address.clear();
  EXPECT_TRUE(contains(refusal(settings), "no V4L2 camera is there"));
}

TEST_F(V4l2Source, UnpluggedItIsLostAndStaysSo) {
  test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_Y12));
  const std::unique_ptr<CameraSource> source = open_v4l2_source(test::settings_for_rig());
  source->start();
  CameraFrame frame;
  ASSERT_EQ(next_of(*source, frame), Received::frame);
  rig.camera.unplug();
  Received received = Received::frame;
  for (int i = 0; i < 50 && received == Received::frame; ++i) received = source->receive(frame, milliseconds(100));
  EXPECT_EQ(received, Received::lost);
  rig.camera.replug();
  EXPECT_EQ(source->receive(frame, milliseconds(100)), Received::lost);
  EXPECT_NO_THROW((void)open_v4l2_source(test::settings_for_rig()));
}

// How long a camera is away the nth time: mostly for a moment, every tenth time for half a second to half a minute.
milliseconds away_for(int n) {
  constexpr std::array<int, 5> long_ms{500, 2000, 5000, 12000, 30000};
  return milliseconds(n % 10 == 4 ? long_ms.at(static_cast<std::size_t>(n / 10)) : 30 + 40 * (n % 7));
}

// How long after each return the first frame is in the session.
TEST_F(V4l2Source, UnpluggedAgainAndAgainItReturnsIntoTheSameSession) {
  const int times = test::repetitions(5, 50);
  const test::TemporaryFolder folder;
  test::V4l2Rig rig(test::pattern_camera(V4L2_PIX_FMT_SRGGB12));
  std::vector<std::int64_t> returned_ns;
  const auto streams = [&] { return rig.camera.counts().streaming; };
  record(folder / "s", test::settings_for_rig(), 1, [&](const auto&) {
    for (int i = 0; i < times; ++i) {
      for (int wait = 0; wait < 500 && !streams(); ++wait) std::this_thread::sleep_for(milliseconds(10));
      std::this_thread::sleep_for(milliseconds(60 + 7 * (i % 5)));
      rig.camera.unplug();
      std::this_thread::sleep_for(away_for(i));
      rig.camera.replug();
      returned_ns.push_back(clock_ns(CLOCK_MONOTONIC));
    }
    for (int wait = 0; wait < 500 && !streams(); ++wait) std::this_thread::sleep_for(milliseconds(10));
    std::this_thread::sleep_for(milliseconds(300));
  });
  const SessionReader reader(folder / "s");
  const auto lost = std::count_if(reader.gaps().begin(), reader.gaps().end(),
                                  [](const FrameGap& gap) { return gap.reason == "the camera was lost"; });
  EXPECT_EQ(lost, times);
  double slowest_s = 0;
  for (const std::int64_t returned : returned_ns) {
    const auto first = std::find_if(reader.frames().begin(), reader.frames().end(),
                                    [&](const SessionFrame& f) { return f.arrival->monotonic_ns > returned; });
    ASSERT_NE(first, reader.frames().end());
    slowest_s = std::max(slowest_s, 1e-9 * static_cast<double>(first->arrival->monotonic_ns - returned));
  }
  EXPECT_LE(slowest_s, 1.0);
  RecordProperty("slowest_return_s", fmt::format("{:.3f}", slowest_s));
  fmt::print("unplugged {} times, back after at most {:.3f} s; {} frames\n", times, slowest_s, reader.frames().size());
  for (const SessionFrame& frame : reader.frames()) {
    const ImageU16 codes = std::get<ImageU16>(reader.read_frame(frame).pixels);
    EXPECT_EQ(test::wrong_pixels(codes, 12, static_cast<std::uint64_t>(frame.arrival->device_frame)), 0);
  }
}

}  // namespace
}  // namespace mf
