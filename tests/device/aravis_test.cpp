// SPDX-License-Identifier: Apache-2.0
// Against Aravis' own GigE Vision camera over loopback: the bytes cross real GVCP and GVSP, and none of the peer is
// ours.
#include <arv.h>
#include <gtest/gtest.h>

#include "device/aravis_source.h"
#include "device/capture.h"
#include "tests/device/scripted_camera.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

std::uint8_t pattern(std::uint64_t frame, int x, int y) {
  return static_cast<std::uint8_t>(frame * 31 + static_cast<std::uint64_t>(x) * 3 + static_cast<std::uint64_t>(y) * 7);
}

void fill(ArvBuffer* buffer, void* /*user_data*/, guint32 /*exposure_us*/, guint32 /*gain*/, ArvPixelFormat) {
  std::size_t size = 0;
  auto* bytes = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
  const int width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      bytes[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          pattern(arv_buffer_get_frame_id(buffer), x, y);
}

class AravisTest : public testing::Test {
 protected:
  void SetUp() override {
    // An address of its own in the loopback network: tests may run side by side.
    camera_ = arv_gv_fake_camera_new("127.0.0.1", "MF01");
    if (camera_ == nullptr || arv_gv_fake_camera_is_running(camera_) == 0)
      GTEST_SKIP() << "another program has the GigE Vision port on 127.0.0.1";
    arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera_), fill, nullptr);
  }
  void TearDown() override {
    if (camera_ != nullptr) g_object_unref(camera_);
  }
  static CameraSettings settings() {
    CameraSettings s;
    s.address = "127.0.0.1";
    s.pixel_format = "Mono8";
    s.region_px = std::array{0, 0, 320, 240};
    s.exposure_s = 0.002;
    s.frame_rate_hz = 50;
    s.socket_buffer_bytes = 1 << 20;
    return s;
  }
  ArvGvFakeCamera* camera_ = nullptr;
};

TEST_F(AravisTest, SettingsAreWrittenAndReadBack) {
  const std::unique_ptr<CameraSource> source = open_aravis_source(settings());
  const CameraDescription& d = source->description();
  EXPECT_EQ(d.width, 320);
  EXPECT_EQ(d.height, 240);
  EXPECT_EQ(d.wire_format, "Mono8");
  EXPECT_NEAR(d.exposure_s, 0.002, 1e-6);
  EXPECT_EQ(d.serial, "MF01");
  EXPECT_NE(d.genicam_xml.find("RegisterDescription"), std::string::npos);
}

TEST_F(AravisTest, FramesCrossTheWireBitForBit) {
  const test::TemporaryFolder folder;
  const std::atomic<bool> stop = false;
  CaptureOptions options;
  options.most_seconds = 1.5;
  const CaptureResult result =
      capture([] { return open_aravis_source(settings()); }, folder / "s", test::header_with_target(), options, stop);
  EXPECT_GT(result.recorder.durable, 20);
  EXPECT_FALSE(result.recorder.failure.has_value());
  const SessionReader reader(folder / "s");
  EXPECT_EQ(reader.header().format, (PixelFormat{PixelLayout::mono, 8}));
  for (const SessionFrame& frame : reader.frames()) {
    const ImageU16 codes = std::get<ImageU16>(reader.read_frame(frame).pixels);
    const auto number = static_cast<std::uint64_t>(frame.arrival->device_frame);
    int wrong = 0;
    for (int y = 0; y < codes.height; ++y)
      for (int x = 0; x < codes.width; ++x) wrong += codes.at(x, y) != pattern(number, x, y) ? 1 : 0;
    EXPECT_EQ(wrong, 0) << "frame " << number;
  }
}

TEST_F(AravisTest, RefusedSettingsNameTheCameraAndTheField) {
  CameraSettings s = settings();
  s.pixel_format = "RGB8";
  const std::string error = test::input_error_of([&] { (void)open_aravis_source(s); });
  EXPECT_TRUE(test::contains(error, "127.0.0.1"));
  EXPECT_TRUE(test::contains(error, "pixel_format"));
}

TEST(Aravis, NoCameraIsOneLine) {
  CameraSettings s;
  s.address = "127.0.0.77";
  const std::string error = test::input_error_of([&] { (void)open_aravis_source(s); });
  EXPECT_TRUE(test::contains(error, "127.0.0.77"));
  EXPECT_TRUE(test::contains(error, "address"));
}

}  // namespace
}  // namespace mf
