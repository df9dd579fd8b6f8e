// SPDX-License-Identifier: Apache-2.0
// Our camera against Aravis' client, which is not ours: discovery, registers, stream, resend, heartbeat.
#include "hw-sim/gige_camera.h"

#include <arv.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <thread>

#include "common/error.h"
#include "device/aravis_source.h"
#include "device/camera_keeper.h"
#include "device/capture.h"
#include "device/clock.h"
#include "hw-sim/gige_registers.h"
#include "tests/device/scripted_camera.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/full_counts.h"
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
  CaptureResult record(const GigeCameraOptions& o, const std::atomic<bool>& stop) {
    return capture([&] { return open_aravis_source(client(o)); }, folder_ / "s", test::header_with_target(), {}, stop);
  }
  // Frames that differ from what the camera sent. All are looked at up to 200, then as many spread over the recording.
  int wrong_frames(const GigeCameraOptions& o) {
    const SessionReader reader(folder_ / "s");
    int wrong = 0;
    const std::size_t step = (reader.frames().size() + 199) / 200;
    for (std::size_t i = 0; i < reader.frames().size(); i += step) {
      const SessionFrame& frame = reader.frames()[i];
      const auto sent = static_cast<std::uint64_t>(frame.arrival->device_frame);
      wrong += std::get<ImageU16>(reader.read_frame(frame).pixels).data != codes_of(sent, o) ? 1 : 0;
    }
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

// A picture that tells the settings it was taken with, as its codes.
void show_settings(const GigeShot& shot, std::span<std::uint8_t> payload) {
  const std::size_t bytes = shot.format.packing == Packing::bytes ? 1 : 2;
  const auto show = [&](std::size_t pixel, double value) {
    const auto code = static_cast<unsigned>(std::lround(value));
    payload[bytes * pixel] = static_cast<std::uint8_t>(code);
    if (bytes == 2) payload[bytes * pixel + 1] = static_cast<std::uint8_t>(code >> 8);
  };
  show(0, static_cast<double>(shot.response.index()));
  show(1, 1e4 * shot.exposure_s);
  show(2, 10 * shot.gain_db);
  if (const auto* slopes = std::get_if<MultiSlopeSensor>(&shot.response)) {
    show(3, static_cast<double>(slopes->knees.size()));
    show(4, 200 * slopes->knees.back().time);
    show(5, 200 * slopes->knees.back().level);
  } else if (const auto* linlog = std::get_if<LinLogSensor>(&shot.response)) {
    show(3, 200 * linlog->value_1);
    show(4, 200 * linlog->value_2);
    show(5, 200 * linlog->time_1);
  }
}

// The first codes of the last of some frames: those on their way still have the settings of before.
std::vector<int> settled_codes(CameraSource& source) {
  CameraFrame frame;
  frame.codes = ImageU16(source.description().width, source.description().height, 1);
  for (int i = 0, got = 0; i < 100 && got < 4; ++i)
    got += source.receive(frame, milliseconds(100)) == Received::frame ? 1 : 0;
  return {frame.codes.data.begin(), frame.codes.data.begin() + 6};
}

TEST_F(GigeCameraTest, AClientsResponseReachesThePictureAndIsReadBack) {
  GigeCameraOptions o = camera("127.0.3.30", "Mono12", 64, 48);
  o.frame_rate_hz = 100;
  const GigeCamera server(o, GigeCamera::Expose(show_settings));
  CameraSettings s = client(o);
  s.exposure_s = 0.02;
  s.gain_db = 6;
  s.response = MultiSlopeSensor{{{0.9, 0.5}, {0.995, 0.75}}};
  const std::unique_ptr<CameraSource> source = open_aravis_source(s);
  const ResponseSetting& slopes = source->description().response;
  EXPECT_EQ(slopes.scheme, "SFNC MultiSlope");
  EXPECT_TRUE(slopes.remarks.empty()) << slopes.remarks.front();
  EXPECT_EQ(std::get<MultiSlopeSensor>(slopes.in_force), std::get<MultiSlopeSensor>(*s.response));
  source->start();
  EXPECT_EQ(settled_codes(*source), (std::vector<int>{1, 200, 60, 2, 199, 150}));
  // While it runs.
  const ResponseSetting linlog =
      apply_response(source->features(), ResponseRequest{LinLogSensor{0.7, 0.5, 0.85, 1}}, 0.02);
  EXPECT_TRUE(linlog.remarks.empty()) << linlog.remarks.front();
  EXPECT_EQ(std::get<LinLogSensor>(linlog.in_force), (LinLogSensor{0.7, 0.5, 0.85, 1}));
  EXPECT_EQ(settled_codes(*source), (std::vector<int>{2, 200, 60, 140, 100, 170}));
  // What the camera refuses, and what it clips.
  EXPECT_NE(test::input_error_of([&] { source->features().set_number("LinLog_Value1", 201); }), "");
  EXPECT_EQ(source->features().number("LinLog_Value1"), 140);
  source->features().set_number("ExposureTime", 1e9);
  EXPECT_EQ(source->features().number("ExposureTime"), 1e7);
}

TEST_F(GigeCameraTest, APixelFormatCanBeChosenFromSeveral) {
  GigeCameraOptions o = camera("127.0.3.31", "Mono12", 64, 48);
  o.more_formats = {wire_format("Mono8").value(), wire_format("BayerRG12p").value()};
  o.frame_rate_hz = 60;
  const GigeCamera server(o, [](std::uint64_t, std::span<std::uint8_t> payload) { fill(7, payload); });
  for (const char* format : {"Mono8", "BayerRG12p", "Mono12"}) {
    CameraSettings s = client(o);
    s.pixel_format = format;
    const std::unique_ptr<CameraSource> source = open_aravis_source(s);
    EXPECT_EQ(source->description().wire_format, format);
    source->start();
    CameraFrame frame;
    frame.codes = ImageU16(o.width, o.height, 1);
    Received received = Received::nothing;
    for (int i = 0; i < 20 && received != Received::frame; ++i) received = source->receive(frame, milliseconds(100));
    ASSERT_EQ(received, Received::frame) << format;
    GigeCameraOptions chosen = o;
    chosen.format = wire_format(format).value();
    EXPECT_EQ(frame.codes.data, codes_of(7, chosen)) << format;
  }
  CameraSettings s = client(o);
  s.pixel_format = "Mono16";
  EXPECT_TRUE(test::contains(test::input_error_of([&] { (void)open_aravis_source(s); }), "pixel_format"));
}

TEST_F(GigeCameraTest, PtpIsSwitchedOnAndReported) {
  GigeCameraOptions o = camera("127.0.3.32", "Mono8", 64, 48);
  o.ptp_offset_ns = -1234;
  const GigeCamera server(o, fill);
  CameraSettings s = client(o);
  {
    const std::unique_ptr<CameraSource> source = open_aravis_source(s);
    EXPECT_TRUE(source->description().ptp.available);
    EXPECT_FALSE(source->description().ptp.enabled);
  }
  s.ptp = true;
  const std::unique_ptr<CameraSource> source = open_aravis_source(s);
  const PtpReport& ptp = source->description().ptp;
  EXPECT_TRUE(ptp.enabled);
  EXPECT_EQ(ptp.status, "Slave");
  EXPECT_EQ(ptp.offset_ns, -1234);
  source->start();
  CameraFrame frame;
  frame.codes = ImageU16(o.width, o.height, 1);
  Received received = Received::nothing;
  for (int i = 0; i < 20 && received != Received::frame; ++i) received = source->receive(frame, milliseconds(100));
  ASSERT_EQ(received, Received::frame);
  // The camera's time is now the host's.
  EXPECT_LT(std::abs(frame.arrival.realtime_ns - frame.arrival.device_ns), 1'000'000'000);
}

// Aravis' own parser reads the chunks.
TEST_F(GigeCameraTest, ChunksTellTimeAndExposure) {
  GigeCameraOptions o = camera("127.0.3.33", "Mono8", 322, 241);
  o.frame_rate_hz = 60;
  const GigeCamera server(o, fill);
  ArvCamera* client = arv_camera_new(o.address.c_str(), nullptr);
  ASSERT_NE(client, nullptr);
  arv_camera_gv_set_stream_options(client, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size(client, 1400, nullptr);
  arv_camera_set_exposure_time(client, 4321, nullptr);
  arv_camera_set_boolean(client, "ChunkModeActive", TRUE, nullptr);
  EXPECT_EQ(arv_camera_get_payload(client, nullptr), 322U * 241U + gige_chunk::bytes);
  ArvStream* stream = arv_camera_create_stream(client, nullptr, nullptr, nullptr);
  ASSERT_NE(stream, nullptr);
  for (int i = 0; i < 4; ++i)
    arv_stream_push_buffer(stream, arv_buffer_new_allocate(arv_camera_get_payload(client, nullptr)));
  arv_camera_start_acquisition(client, nullptr);
  ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream, 2'000'000);
  ASSERT_NE(buffer, nullptr);
  ASSERT_EQ(arv_buffer_get_status(buffer), ARV_BUFFER_STATUS_SUCCESS);
  ArvChunkParser* parser = arv_camera_create_chunk_parser(client);
  EXPECT_DOUBLE_EQ(arv_chunk_parser_get_float_value(parser, buffer, "ChunkExposureTime", nullptr), 4321);
  EXPECT_EQ(static_cast<std::uint64_t>(arv_chunk_parser_get_integer_value(parser, buffer, "ChunkTimestamp", nullptr)),
            arv_buffer_get_timestamp(buffer));
  std::size_t size = 0;
  const auto* image = static_cast<const std::uint8_t*>(arv_buffer_get_image_data(buffer, &size));
  std::vector<std::uint8_t> expected(322U * 241U);
  fill(arv_buffer_get_frame_id(buffer), expected);
  ASSERT_GE(size, expected.size());
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), image));
  g_object_unref(parser);
  g_object_unref(buffer);
  g_object_unref(stream);
  g_object_unref(client);
}

// 0.1 % of the frames may be missing, and each of them must be accounted for.
TEST_F(GigeCameraTest, LostPacketsAreAskedForAgain) {
  const int size_px = test::repetitions(512, 1024);
  GigeCameraOptions o = camera("127.0.3.2", "BayerRG12", size_px, size_px);
  o.packet_loss = 0.01;
  o.most_frames = test::repetitions(200, 4000);
  GigeCamera server(o, fill);
  std::atomic<bool> stop = false;
  std::thread watch([&] {
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(10 + o.most_frames / 5);
    while (server.counts().frames < o.most_frames && std::chrono::steady_clock::now() < patience)
      std::this_thread::sleep_for(milliseconds(50));
    std::this_thread::sleep_for(milliseconds(800));  // what is still asked for again
    stop = true;
  });
  const CaptureResult result = record(o, stop);
  watch.join();
  const GigeCameraCounts counts = server.counts();
  EXPECT_EQ(counts.frames, o.most_frames);
  EXPECT_GT(counts.dropped, 2 * o.most_frames);
  const SessionReader reader(folder_ / "s");
  const auto complete = static_cast<std::int64_t>(reader.frames().size());
  std::int64_t missing = 0;
  for (const FrameGap& gap : reader.gaps()) missing += gap.missing;
  ASSERT_GT(complete, 0);
  const std::int64_t sent = reader.frames().back().arrival->device_frame - reader.frames()[0].arrival->device_frame + 1;
  EXPECT_EQ(complete + missing, sent);
  EXPECT_EQ(result.recorder.durable, complete);
  EXPECT_GE(1000 * complete, 999 * sent);
  EXPECT_EQ(wrong_frames(o), 0);
  std::printf("%d packets lost at first, %d sent again; %d of %d frames complete, %d in gap rows\n",
              static_cast<int>(counts.dropped), static_cast<int>(counts.resent), static_cast<int>(complete),
              static_cast<int>(sent), static_cast<int>(missing));
}

// How long after each return the first frame is in the session. A short death is noticed by nothing but its silence.
TEST_F(GigeCameraTest, ADeadCameraComesBackIntoTheSameSession) {
  const std::vector<double> all_deaths_s{0.5, 1.7, 6, 0.8, 1,  1.3,  2,  2.5, 3,  3.5,
                                         4,   4.5, 5, 7.5, 10, 12.5, 15, 20,  25, 30};
  const std::size_t deaths = static_cast<std::size_t>(test::repetitions(3, static_cast<int>(all_deaths_s.size())));
  const GigeCameraOptions o = camera("127.0.3.3", "Mono8", 320, 240);
  GigeCamera server(o, fill);
  std::vector<std::int64_t> returned_ns;
  std::atomic<bool> stop = false;
  std::thread fate([&] {
    const auto let_stream = [&] {
      const std::int64_t before = server.counts().frames;
      for (int wait = 0; wait < 1000 && server.counts().frames < before + 20; ++wait)
        std::this_thread::sleep_for(milliseconds(10));
    };
    for (std::size_t i = 0; i < deaths; ++i) {
      let_stream();
      server.die();
      std::this_thread::sleep_for(std::chrono::duration<double>(all_deaths_s[i]));
      server.revive();
      returned_ns.push_back(clock_ns(CLOCK_MONOTONIC));
    }
    let_stream();
    stop = true;
  });
  record(o, stop);
  fate.join();
  const SessionReader reader(folder_ / "s");
  const auto lost = std::count_if(reader.gaps().begin(), reader.gaps().end(),
                                  [](const FrameGap& gap) { return gap.reason == "the camera was lost"; });
  EXPECT_EQ(lost, static_cast<std::ptrdiff_t>(deaths));
  double slowest_s = 0;
  for (std::size_t i = 0; i < deaths; ++i) {
    const auto first = std::find_if(reader.frames().begin(), reader.frames().end(),
                                    [&](const SessionFrame& f) { return f.arrival->monotonic_ns > returned_ns[i]; });
    ASSERT_NE(first, reader.frames().end());
    const double after_s = 1e-9 * static_cast<double>(first->arrival->monotonic_ns - returned_ns[i]);
    std::printf("dead for %4.1f s, first frame %.2f s after it was back\n", all_deaths_s[i], after_s);
    slowest_s = std::max(slowest_s, after_s);
  }
  EXPECT_LE(slowest_s, 1.0);
}

// Stopping needs nothing of the camera.
TEST_F(GigeCameraTest, ADeadCameraDoesNotHoldUpTheStop) {
  const GigeCameraOptions o = camera("127.0.3.6", "Mono8", 320, 240);
  GigeCamera server(o, fill);
  CameraKeeper keeper([&] { return open_aravis_source(client(o)); }, milliseconds(200));
  CameraFrame frame;
  frame.codes = ImageU16(o.width, o.height, 1);
  double slowest_s = 0;
  const auto died = std::chrono::steady_clock::now();
  server.die();
  bool lost = false;
  for (double elapsed_s = 0; elapsed_s < 9;) {  // Aravis gives up after four to six seconds
    const auto before = std::chrono::steady_clock::now();
    lost |= keeper.receive(frame, milliseconds(100)) == Received::lost;
    const auto after = std::chrono::steady_clock::now();
    slowest_s = std::max(slowest_s, std::chrono::duration<double>(after - before).count());
    elapsed_s = std::chrono::duration<double>(after - died).count();
  }
  EXPECT_TRUE(lost);
  EXPECT_LT(slowest_s, 0.5);
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
