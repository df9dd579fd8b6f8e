// SPDX-License-Identifier: Apache-2.0
#include "device/recorder.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "device/capture.h"
#include "tests/device/scripted_camera.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/pictures.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using std::chrono::milliseconds;
using test::ScriptedCamera;

test::Script script_of(int frames, int period_ms, std::set<int> skipped = {}, std::set<int> incomplete = {}) {
  test::Script script;
  script.frames = frames;
  script.period = milliseconds(period_ms);
  script.skipped = std::move(skipped);
  script.incomplete = std::move(incomplete);
  return script;
}

// Until the camera has given all its frames.
CaptureResult record(const std::filesystem::path& session, const test::Script& script) {
  const auto shared = std::make_shared<test::ScriptRun>(script);
  CaptureOptions options;
  options.reopen_each = milliseconds(20);
  options.most_seconds = 60;
  return capture([=] { return std::make_unique<ScriptedCamera>(shared); }, session, test::header_with_target(), options,
                 shared->done);
}

void wait_for_frames(const std::filesystem::path& session, std::size_t count) {
  for (int i = 0; i < 600; ++i) {
    std::this_thread::sleep_for(milliseconds(50));
    if (std::filesystem::exists(session / "frames/000000.tif") && SessionReader(session).frames().size() >= count)
      return;
  }
}

TEST(Recorder, EveryFrameComesBackBitForBitWithItsClocks) {
  const test::TemporaryFolder folder;
  const CaptureResult result = record(folder / "s", script_of(40, 5));
  EXPECT_EQ(result.recorder.durable, 40);
  EXPECT_EQ(result.recorder.lost, 0);
  EXPECT_FALSE(result.recorder.failure.has_value());
  const SessionReader reader(folder / "s");
  ASSERT_EQ(reader.frames().size(), 40U);
  EXPECT_TRUE(reader.gaps().empty());
  for (const SessionFrame& frame : reader.frames()) {
    ASSERT_TRUE(frame.arrival.has_value());
    EXPECT_EQ(frame.arrival->device_frame, frame.id + 1);
    EXPECT_EQ(std::get<ImageU16>(reader.read_frame(frame).pixels).data,
              test::scripted_codes(frame.arrival->device_frame).data);
  }
  EXPECT_EQ(reader.document("device").value()["model"], "scripted");
}

TEST(Recorder, SkippedAndIncompleteFramesAreGaps) {
  const test::TemporaryFolder folder;
  const CaptureResult result = record(folder / "s", script_of(30, 3, {10, 11, 12}, {20}));
  EXPECT_EQ(result.recorder.durable, 26);
  EXPECT_EQ(result.recorder.lost, 4);
  const SessionReader reader(folder / "s");
  ASSERT_EQ(reader.gaps().size(), 2U);
  EXPECT_EQ(reader.gaps()[0].missing, 3);
  EXPECT_EQ(reader.frames()[static_cast<std::size_t>(reader.gaps()[0].next_id)].arrival->device_frame, 13);
  EXPECT_EQ(reader.gaps()[1].missing, 1);
  EXPECT_EQ(reader.frames()[static_cast<std::size_t>(reader.gaps()[1].next_id)].arrival->device_frame, 21);
}

TEST(Recorder, ALostCameraComesBackIntoTheSameSession) {
  const test::TemporaryFolder folder;
  test::Script script = script_of(40, 5);
  script.dies_after = 15;
  script.dead_for = milliseconds(100);
  const CaptureResult result = record(folder / "s", script);
  EXPECT_EQ(result.recorder.durable, 40);
  const SessionReader reader(folder / "s");
  ASSERT_EQ(reader.gaps().size(), 1U);
  EXPECT_EQ(reader.gaps()[0].next_id, 15);
  EXPECT_EQ(reader.gaps()[0].missing, 0);
  EXPECT_EQ(reader.gaps()[0].reason, "the camera was lost");
}

TEST(Recorder, AKilledProcessLeavesWhatWasDurable) {
  const test::TemporaryFolder folder;
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    (void)record(folder / "s", script_of(100000, 2));
    _exit(0);
  }
  wait_for_frames(folder / "s", 50);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  const SessionReader reader(folder / "s");
  ASSERT_GE(reader.frames().size(), 50U);
  for (const SessionFrame& frame : reader.frames())
    EXPECT_EQ(std::get<ImageU16>(reader.read_frame(frame).pixels).data,
              test::scripted_codes(frame.arrival->device_frame).data);
}

TEST(Recorder, AnErrorOfTheDiskEndsTheRecordingAndKeepsWhatWasDurable) {
  const test::TemporaryFolder folder;
  std::thread saboteur([&] {
    wait_for_frames(folder / "s", 50);
    std::filesystem::rename(folder / "s/frames", folder / "s/away");
  });
  const CaptureResult result = record(folder / "s", script_of(100000, 5));
  saboteur.join();
  ASSERT_TRUE(result.recorder.failure.has_value());
  EXPECT_NE(result.recorder.failure->find("frames/"), std::string::npos) << *result.recorder.failure;
  std::filesystem::rename(folder / "s/away", folder / "s/frames");
  const SessionReader reader(folder / "s");
  EXPECT_GE(reader.frames().size(), 50U);
  for (const SessionFrame& frame : reader.frames()) (void)reader.read_frame(frame);
}

TEST(Recorder, AFullQueueRefusesFramesAndSaysSo) {
  const test::TemporaryFolder folder;
  SessionHeader header = test::header_with_target();
  const CameraDescription camera = test::scripted_description();
  header.format = camera.format;
  header.width = camera.width;
  header.height = camera.height;
  Recorder recorder(SessionWriter(folder / "s", header, {SessionWriter::Durability::batches}), camera, 0,
                    RecorderOptions{2, milliseconds(250)});
  CameraFrame* a = recorder.acquire();
  CameraFrame* b = recorder.acquire();
  ASSERT_NE(a, nullptr);
  ASSERT_NE(b, nullptr);
  EXPECT_EQ(recorder.acquire(), nullptr);
  recorder.give_back(a);
  EXPECT_NE(recorder.acquire(), nullptr);
  recorder.note_gap(1, 5, "full");
  recorder.note_gap(1, 6, "full");
  recorder.finish();
  EXPECT_EQ(recorder.status().lost, 2);
  std::int64_t missing = 0;
  for (const FrameGap& gap : SessionReader(folder / "s").gaps()) missing += gap.missing;
  EXPECT_EQ(missing, 2);
}

TEST(Capture, NumbersOfSixteenBitsGoRound) {
  EXPECT_EQ(frames_between(4, 5), 0);
  EXPECT_EQ(frames_between(4, 8), 3);
  EXPECT_EQ(frames_between(65535, 1), 0);
  EXPECT_EQ(frames_between(65534, 3), 3);
  EXPECT_EQ(frames_between(10, 10), 0);  // a repeat is no gap
  EXPECT_EQ(frames_between(70000, 70002), 1);
}

TEST(Capture, ACameraThatIsNotThereMakesNoSession) {
  const test::TemporaryFolder folder;
  const std::atomic<bool> stop = false;
  const std::string error = test::input_error_of([&] {
    (void)capture([]() -> std::unique_ptr<CameraSource> { throw InputError("10.0.0.9", "address", "none answers"); },
                  folder / "s", test::header_with_target(), {}, stop);
  });
  EXPECT_TRUE(test::contains(error, "10.0.0.9"));
  EXPECT_FALSE(std::filesystem::exists(folder / "s"));
}

}  // namespace
}  // namespace mf
