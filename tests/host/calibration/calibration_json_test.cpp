// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_file.h"
#include "host/calibration/calibration.h"
#include "tests/host/calibration/synthetic_views.h"

namespace mf {
namespace {

class CalibrationJson : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("mf_calibration_json_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

TEST_F(CalibrationJson, ComesBackAsItWas) {
  Calibration c;
  c.camera = testing::ordinary_camera();
  c.camera.parameters[4] = -0.123456789012345;
  c.camera.parameters[8] = 0.01;
  c.camera_sigma[1] = 0.03;
  c.cam_from_world = testing::facing_pose(1.3, 0.8, 0.2, {0.1, 0});
  c.rms_px = 0.12;
  c.frames.push_back({"a.png", testing::facing_pose(1, 0.4, 0.3, {0, 0}), 0.11, 100, 4, true, "", 1e-4, 2e-4});
  c.frames.push_back({"b.png", {}, 0, 0, 0, false, "no tag found", 0, 0});
  c.options["distortion"] = "brown";
  write_calibration(folder_ / "calibration.json", c);
  const Calibration back = read_calibration(folder_ / "calibration.json");
  EXPECT_EQ(back.camera.parameters, c.camera.parameters);
  EXPECT_EQ(back.camera.width, c.camera.width);
  EXPECT_EQ(back.camera_sigma, c.camera_sigma);
  ASSERT_TRUE(back.cam_from_world);
  EXPECT_LT(rotation_angle_between(*back.cam_from_world, *c.cam_from_world), 1e-9);
  ASSERT_EQ(back.frames.size(), 2U);
  EXPECT_TRUE(back.frames[0].used);
  EXPECT_LT((back.frames[0].cam_from_mirror.matrix() - c.frames[0].cam_from_mirror.matrix()).norm(), 1e-12);
  EXPECT_EQ(back.frames[0].outlier_corners, 4);
  EXPECT_FALSE(back.frames[1].used);
  EXPECT_EQ(back.frames[1].why_not, "no tag found");
  EXPECT_EQ(back.options, c.options);
  // What other programs read by name.
  const nlohmann::json json = read_json_file(folder_ / "calibration.json");
  EXPECT_EQ(json.at("K").at(0).at(0).get<double>(), c.camera.fx());
  EXPECT_EQ(json.at("K").at(1).at(2).get<double>(), c.camera.cy());
  EXPECT_EQ(json.at("frames").at(0).at("cam_from_mirror").size(), 4U);
  EXPECT_FALSE(json.at("frames").at(1).at("used").get<bool>());
}

TEST_F(CalibrationJson, NamesTheFieldThatIsWrong) {
  Calibration c;
  c.camera = testing::ordinary_camera();
  c.frames.push_back({"a.png", testing::facing_pose(1, 0.4, 0.3, {0, 0}), 0.11, 100, 4, true, "", 1e-4, 2e-4});
  const std::filesystem::path file = folder_ / "calibration.json";
  write_calibration(file, c);
  const nlohmann::json good = read_json_file(file);
  const auto fault = [&](const char* pointer, const nlohmann::json& value) -> std::string {
    nlohmann::json bad = good;
    bad[nlohmann::json::json_pointer(pointer)] = value;
    write_json_file(file, bad);
    try {
      (void)read_calibration(file);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_NE(fault("/K/0/0", -5).find('K'), std::string::npos);
  EXPECT_NE(fault("/width", 0).find("width"), std::string::npos);
  EXPECT_NE(fault("/frames/0/cam_from_mirror/0/0", 3.0).find("a.png: cam_from_mirror"), std::string::npos);
  EXPECT_NE(fault("/frames", "none").find("frames"), std::string::npos);
}

}  // namespace
}  // namespace mf
