// SPDX-License-Identifier: Apache-2.0
//
// The path-traced desk capture through the program as a user runs it, against its truth.
#include <algorithm>
#include <iostream>
#include <numbers>

#include "common/json_file.h"
#include "host/calibration/calibration.h"
#include "tests/host/desk/desk_run.h"
#include "tests/host/desk/desk_truth.h"

namespace mf::test {
namespace {

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

class DeskCalibration : public DeskRun {
 protected:
  void SetUp() override {
    DeskRun::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    found_ = read_calibration(session() / "calibration.json");
    truth_ = read_json_file(desk_folder() / "truth" / "calibration.json");
  }
  Calibration found_;
  nlohmann::json truth_;
};

TEST_F(DeskCalibration, CameraIsRight) {
  const double f = truth_.at("K").at(0).at(0), cx = truth_.at("K").at(0).at(2), cy = truth_.at("K").at(1).at(2);
  RecordProperty("fx_error_percent", std::to_string(100 * (found_.camera.fx() / f - 1)));
  EXPECT_NEAR(found_.camera.fx(), f, 1e-3 * f);
  EXPECT_NEAR(found_.camera.fy(), f, 1e-3 * f);
  EXPECT_LT(std::hypot(found_.camera.cx() - cx, found_.camera.cy() - cy), 0.5);
  EXPECT_LE(found_.rms_px, 0.2);
  std::cout << "camera: focal length off by " << 100 * std::abs(found_.camera.fx() / f - 1) << " %, principal point by "
            << std::hypot(found_.camera.cx() - cx, found_.camera.cy() - cy) << " px, RMS " << found_.rms_px << " px\n";
}

TEST_F(DeskCalibration, MirrorPosesAndWorldAreRight) {
  const Rigid3 cam_from_world = rigid3_from_json(truth_.at("cam_from_world"), "cam_from_world", "truth");
  const nlohmann::json names = read_json_file(desk_folder() / "frames.json");
  ASSERT_EQ(found_.frames.size(), names.size());
  std::vector<double> rotation_deg, position_mm;
  for (std::size_t i = 0; i < names.size(); ++i) {
    ASSERT_EQ(found_.frames[i].name, names[i].at("frame").get<std::string>());
    if (!found_.frames[i].used) continue;
    const Rigid3 truth =
        cam_from_world * rigid3_from_json(truth_.at("world_from_mirror").at(i), "world_from_mirror", "truth");
    rotation_deg.push_back(rotation_angle_between(found_.frames[i].cam_from_mirror, truth) * 180 / std::numbers::pi);
    position_mm.push_back(1e3 * (found_.frames[i].cam_from_mirror.translation - truth.translation).norm());
  }
  RecordProperty("frames_posed", static_cast<int>(rotation_deg.size()));
  std::cout << "poses: " << rotation_deg.size() << " of " << names.size() << ", median " << median(rotation_deg)
            << " deg, " << median(position_mm) << " mm, worst "
            << *std::max_element(rotation_deg.begin(), rotation_deg.end()) << " deg, "
            << *std::max_element(position_mm.begin(), position_mm.end()) << " mm\n";
  EXPECT_GE(static_cast<double>(rotation_deg.size()), 0.96 * static_cast<double>(names.size()));
  EXPECT_LE(median(rotation_deg), 0.03);
  EXPECT_LE(median(position_mm), 0.3);
  EXPECT_LE(*std::max_element(rotation_deg.begin(), rotation_deg.end()), 0.3);
  EXPECT_LE(*std::max_element(position_mm.begin(), position_mm.end()), 3);
  ASSERT_TRUE(found_.cam_from_world);
  EXPECT_LT(rotation_angle_between(*found_.cam_from_world, cam_from_world) * 180 / std::numbers::pi, 0.03);
  EXPECT_LT((found_.cam_from_world->translation - cam_from_world.translation).norm(), 0.5e-3);
}

TEST_F(DeskCalibration, SummarySaysWhatWasMeasured) {
  const nlohmann::json& measured = summary("calibrate");
  EXPECT_EQ(measured.at("frames").get<std::size_t>(), found_.frames.size());
  EXPECT_EQ(measured.at("used").get<std::size_t>() + measured.at("unposed").size(), found_.frames.size());
  for (const nlohmann::json& frame : measured.at("unposed"))
    EXPECT_FALSE(frame.at("why_not").get<std::string>().empty());
}

}  // namespace
}  // namespace mf::test
