// SPDX-License-Identifier: Apache-2.0
#include "device/config.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

class DeviceConfigTest : public testing::Test {
 protected:
  DeviceConfig read(const std::string& text) {
    std::ofstream(folder_ / "rig.toml") << text;
    return read_device_config(folder_ / "rig.toml");
  }
  std::string error_of(const std::string& text) {
    return test::input_error_of([&] { (void)read(text); });
  }
  test::TemporaryFolder folder_;
};

constexpr const char* smallest = "[mirror]\ntarget = 'target.json'\n[recording]\nfolder = '/var/lib/mirrorfield'\n";

TEST_F(DeviceConfigTest, PathsAreRelativeToTheFile) {
  const DeviceConfig config = read(smallest);
  EXPECT_EQ(config.target, folder_ / "target.json");
  EXPECT_EQ(config.recordings, "/var/lib/mirrorfield");
  EXPECT_FALSE(config.camera.exposure_s.has_value());
}

TEST_F(DeviceConfigTest, EveryKeyIsRead) {
  const DeviceConfig config = read(std::string(smallest) +
                                   "queue_frames = 9\nblack_level_hint = 64\n[camera]\naddress = '10.0.0.2'\n"
                                   "pixel_format = 'BayerRG12'\nregion_px = [0, 8, 640, 480]\nexposure_s = 0.01\n"
                                   "gain_db = 3\nframe_rate_hz = 37\npacket_bytes = 8000\n");
  EXPECT_EQ(config.camera.address, "10.0.0.2");
  EXPECT_EQ(config.camera.pixel_format, "BayerRG12");
  EXPECT_EQ(config.camera.region_px, (std::array{0, 8, 640, 480}));
  EXPECT_EQ(config.camera.exposure_s, 0.01);
  EXPECT_EQ(config.camera.gain_db, 3);
  EXPECT_EQ(config.camera.frame_rate_hz, 37);
  EXPECT_EQ(config.camera.packet_bytes, 8000);
  EXPECT_EQ(config.recorder.queue_frames, 9);
  EXPECT_EQ(config.black_level_hint, 64);
}

TEST_F(DeviceConfigTest, FaultsNameFileAndKey) {
  const auto expect = [&](const std::string& text, const std::string& part) {
    const std::string error = error_of(text);
    EXPECT_NE(error.find("rig.toml"), std::string::npos) << error;
    EXPECT_NE(error.find(part), std::string::npos) << error;
  };
  expect(std::string(smallest) + "[camera]\nexposure = 0.01\n", "camera.exposure: is no key");
  expect(std::string(smallest) + "[kamera]\n", "kamera: is no table");
  expect(std::string(smallest) + "[camera]\nexposure_s = 'long'\n", "camera.exposure_s: must be a number");
  expect(std::string(smallest) + "[camera]\nexposure_s = 0.0\n", "camera.exposure_s: must lie");
  expect(std::string(smallest) + "[camera]\nexposure_s = nan\n", "camera.exposure_s: must lie");
  expect(std::string(smallest) + "[camera]\nregion_px = [1, 2]\n", "camera.region_px");
  expect("[mirror]\n[recording]\nfolder = 'a'\n", "mirror.target: is missing");
  expect("[mirror\n", "line 1");
  expect("camera = 3\n", "camera: must be a table");
}

TEST_F(DeviceConfigTest, AMissingFileIsNamed) {
  const std::string error = test::input_error_of([&] { (void)read_device_config(folder_ / "none.toml"); });
  EXPECT_NE(error.find("none.toml"), std::string::npos);
}

}  // namespace
}  // namespace mf
