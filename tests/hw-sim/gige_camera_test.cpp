// SPDX-License-Identifier: Apache-2.0
// Our camera against Aravis' client, which is not ours: discovery, registers, stream, resend, heartbeat.
#include "hw-sim/gige_camera.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <thread>

#include "common/error.h"
#include "device/aravis_source.h"
#include "device/capture.h"
#include "tests/device/scripted_camera.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf::sim {
namespace {

using std::chrono::milliseconds;

// A generator's bytes are as good as noise: a packet in another's place shows.
void fill(std::uint64_t number, std::span<std::uint8_t> payload) {
  std::uint64_t state = number * 0x9E3779B97F4A7C15U;
  for (std::uint8_t& byte : payload) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    byte = static_cast<std::uint8_t>(state >> 56);
  }
}

std::vector<std::uint16_t> codes_of(std::uint64_t number, const GigeCameraOptions& o) {
  const auto pixels = static_cast<std::size_t>(o.width) * static_cast<std::size_t>(o.height);
  std::vector<std::uint8_t> payload(o.format.bytes_for(pixels));
  fill(number, payload);
  std::vector<std::uint16_t> codes(pixels);
  unpack(o.format, payload, codes);
  return codes;
}

// Each test has its own loopback address, so that tests run side by side.
class GigeCameraTest : public testing::Test {
 protected:
  static GigeCameraOptions camera(const std::string& address, std::string_view format, int width, int height) {
    GigeCameraOptions o;
    o.address = address;
    o.format = wire_format(format).value();
    o.width = width;
    o.height = height;
    return o;
  }
  static CameraSettings client(const GigeCameraOptions& o) {
    CameraSettings s;
    s.address = o.address;
    s.socket_buffer_bytes = 4 << 20;
    return s;
  }
  CaptureResult record(const GigeCameraOptions& o, double seconds) {
    const std::atomic<bool> stop = false;
    CaptureOptions options;
    options.most_seconds = seconds;
    return capture([&] { return open_aravis_source(client(o)); }, folder_ / "s", test::header_with_target(), options,
                   stop);
  }
  // Frames that differ from what the camera sent.
  int wrong_frames(const GigeCameraOptions& o) {
    const SessionReader reader(folder_ / "s");
    int wrong = 0;
    for (const SessionFrame& frame : reader.frames())
      wrong += std::get<ImageU16>(reader.read_frame(frame).pixels).data !=
                       codes_of(static_cast<std::uint64_t>(frame.arrival->device_frame), o)
                   ? 1
                   : 0;
    return wrong;
  }
  test::TemporaryFolder folder_;
};

TEST_F(GigeCameraTest, TellsItsClientWhatItIsAndKeepsWhatItSets) {
  const GigeCameraOptions o = camera("127.0.3.1", "BayerRG12", 320, 240);
  const GigeCamera server(o, fill);
  CameraSettings s = client(o);
  s.exposure_s = 0.0035;
  s.gain_db = 6;
  s.frame_rate_hz = 12.5;
  const std::unique_ptr<CameraSource> source = open_aravis_source(s);
  const CameraDescription& d = source->description();
  EXPECT_EQ(d.vendor, "Mirrorfield");
  EXPECT_EQ(d.serial, "MF0001");
  EXPECT_EQ(d.wire_format, "BayerRG12");
  EXPECT_EQ(d.width, 320);
  EXPECT_EQ(d.height, 240);
  EXPECT_DOUBLE_EQ(d.exposure_s, 0.0035);
  EXPECT_DOUBLE_EQ(d.gain_db, 6);
  EXPECT_DOUBLE_EQ(d.frame_rate_hz, 12.5);
}

TEST_F(GigeCameraTest, EveryPackingArrivesBitForBit) {
  int number = 0;
  for (const char* format : {"Mono8", "Mono10p", "Mono10Packed", "Mono12", "Mono12p", "BayerGB12Packed", "Mono16"}) {
    GigeCameraOptions o = camera("127.0.3." + std::to_string(10 + number++), format, 322, 241);
    o.frame_rate_hz = 60;
    const GigeCamera server(o, fill);
    const std::unique_ptr<CameraSource> source = open_aravis_source(client(o));
    source->start();
    CameraFrame frame;
    frame.codes = ImageU16(o.width, o.height, 1);
    int got = 0;
    for (int i = 0; i < 50 && got < 3; ++i)
      if (source->receive(frame, milliseconds(100)) == Received::frame) {
        ++got;
        EXPECT_EQ(frame.codes.data, codes_of(static_cast<std::uint64_t>(frame.arrival.device_frame), o)) << format;
      }
    EXPECT_EQ(got, 3) << format;
  }
}

TEST_F(GigeCameraTest, LostPacketsAreAskedForAgain) {
  GigeCameraOptions o = camera("127.0.3.2", "BayerRG12", 512, 512);
  o.packet_loss = 0.01;
  o.most_frames = 100;
  const GigeCamera server(o, fill);
  const CaptureResult result = record(o, 6);
  const GigeCameraCounts counts = server.counts();
  EXPECT_EQ(counts.frames, 100);
  EXPECT_GT(counts.dropped, 200);
  EXPECT_GT(counts.resent, 200);
  // On a machine that stalls, frames can be lost for good: then they are counted.
  const SessionReader reader(folder_ / "s");
  ASSERT_GT(reader.frames().size(), 50U);
  EXPECT_EQ(result.recorder.durable, static_cast<std::int64_t>(reader.frames().size()));
  EXPECT_GE(result.recorder.durable + result.recorder.lost, reader.frames().back().arrival->device_frame);
  EXPECT_EQ(wrong_frames(o), 0);
}

TEST_F(GigeCameraTest, ADeadCameraComesBackIntoTheSameSession) {
  GigeCameraOptions o = camera("127.0.3.3", "Mono8", 320, 240);
  GigeCamera server(o, fill);
  std::chrono::steady_clock::time_point revived;
  std::thread fate([&] {
    std::this_thread::sleep_for(milliseconds(800));
    server.die();
    std::this_thread::sleep_for(milliseconds(6000));
    server.revive();
    revived = std::chrono::steady_clock::now();
  });
  const CaptureResult result = record(o, 9);
  fate.join();
  const SessionReader reader(folder_ / "s");
  bool lost = false;
  std::int64_t back_ns = 0;
  for (const FrameGap& gap : reader.gaps()) {
    if (gap.reason != "the camera was lost") continue;
    lost = true;
    ASSERT_LT(gap.next_id, static_cast<std::int64_t>(reader.frames().size()));
    back_ns = reader.frames()[static_cast<std::size_t>(gap.next_id)].arrival->monotonic_ns;
  }
  ASSERT_TRUE(lost);
  EXPECT_GT(result.recorder.durable, 60);
  const double after_s =
      1e-9 * static_cast<double>(back_ns - std::chrono::nanoseconds(revived.time_since_epoch()).count());
  std::printf("first frame %.2f s after the camera was back\n", after_s);
  EXPECT_LT(after_s, 5);
}

TEST_F(GigeCameraTest, ASecondClientIsRefused) {
  const GigeCameraOptions o = camera("127.0.3.4", "Mono8", 64, 48);
  const GigeCamera server(o, fill);
  const std::unique_ptr<CameraSource> first = open_aravis_source(client(o));
  CameraSettings s = client(o);
  s.exposure_s = 0.5;
  EXPECT_NE(test::input_error_of([&] { (void)open_aravis_source(s); }), "");
}

TEST_F(GigeCameraTest, ATakenPortIsOneLine) {
  const GigeCameraOptions o = camera("127.0.3.5", "Mono8", 64, 48);
  const GigeCamera server(o, fill);
  const std::string error = test::input_error_of([&] { const GigeCamera second(o, fill); });
  EXPECT_TRUE(test::contains(error, "127.0.3.5"));
  EXPECT_TRUE(test::contains(error, "3956"));
}

}  // namespace
}  // namespace mf::sim
