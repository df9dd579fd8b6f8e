// SPDX-License-Identifier: Apache-2.0
//
// Detection and online pose on a path-traced capture that is not ours, against its true poses. The daemon's way: codes
// of the sensor, the response that its registers tell, tags at a quarter of the pixels.
#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>
#include <numbers>

#include "common/json_file.h"
#include "device/detection.h"
#include "device/online_pose.h"
#include "device/quick_camera.h"
#include "host/io/image_file.h"
#include "tests/device/seen_tags.h"

namespace mf {
namespace {

namespace fs = std::filesystem;
using test::median_of;

const fs::path desk = fs::path(MF_SHARED_DATA) / "desk";

Rigid3 rigid3_of(const nlohmann::json& rows) {
  Eigen::Matrix4d m;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) m(i, j) = rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j));
  return *Rigid3::from_matrix(m);
}

class DeskPose : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(desk)) GTEST_SKIP() << "the desk capture is absent: " << desk;
    mirror_ = mirror_target_from_json(read_json_file(desk / "target.json"), "target.json");
    world_ = world_target_from_json(read_json_file(desk / "world.json"), "world.json");
    const nlohmann::json truth = read_json_file(desk / "truth" / "calibration.json");
    const nlohmann::json& k = truth.at("K");
    camera_ = {768, 768, {k[0][0], k[1][1], k[0][2], k[1][2], 0, 0, 0, 0, 0}};
    cam_from_world_ = rigid3_of(truth.at("cam_from_world"));
    for (const nlohmann::json& pose : truth.at("world_from_mirror")) world_from_mirror_.push_back(rigid3_of(pose));
    detector_.emplace(DetectionOptions{}, linlog_response(12, 64, 1, 6000, 3), *parse_pixel_format("BayerRG12"));
  }
  [[nodiscard]] DetectedFrame detect(const fs::path& file) {
    CameraFrame frame;
    frame.codes = std::get<ImageU16>(read_image(file));
    return detector_->detect(frame);
  }

  MirrorTarget mirror_;
  WorldTarget world_;
  CameraModel camera_;
  Rigid3 cam_from_world_;
  std::vector<Rigid3> world_from_mirror_;
  std::optional<FrameDetector> detector_;
};

TEST_F(DeskPose, MirrorAndWorldArePosed) {
  WorldPoseEstimate world(world_);
  world.add(detect(desk / "scene.png").tags, camera_);
  ASSERT_TRUE(world.pose());
  const Rigid3 world_from_cam = world.pose()->cam_from_target.inverse();
  EXPECT_LT((world_from_cam.translation - cam_from_world_.inverse().translation).norm(), 0.004);

  QuickCamera quick(mirror_, 768, 768);
  std::vector<double> position, rotation, milliseconds;
  int frames = 0, posed = 0;
  for (std::size_t i = 0; i < world_from_mirror_.size(); i += MF_DESK_STRIDE, ++frames) {
    const DetectedFrame seen = detect(desk / "frames" / fmt::format("{:05}.png", i));
    milliseconds.push_back(seen.milliseconds);
    quick.add(seen.tags);
    const std::optional<OnlinePose> pose = online_mirror_pose(seen.tags, mirror_, camera_);
    if (!pose) continue;
    ++posed;
    const Rigid3 truth = cam_from_world_ * world_from_mirror_[i];
    position.push_back((pose->cam_from_target.translation - truth.translation).norm());
    rotation.push_back(rotation_angle_between(pose->cam_from_target, truth) * 180 / std::numbers::pi);
  }
  const double worst_deg = *std::max_element(rotation.begin(), rotation.end());
  std::cout << fmt::format(
      "desk: {} of {} frames posed, median {:.2f} mm {:.3f} deg (worst {:.1f} mm {:.2f} deg), detection {:.1f} ms\n",
      posed, frames, 1e3 * median_of(position), median_of(rotation),
      1e3 * *std::max_element(position.begin(), position.end()), worst_deg, median_of(milliseconds));
  EXPECT_GE(posed, frames * 9 / 10);
  EXPECT_LT(median_of(position), 0.001);
  EXPECT_LT(median_of(rotation), 0.15);
  EXPECT_LT(worst_deg, 5);  // no pose with the wrong tilt
  ASSERT_TRUE(quick.camera());
  std::cout << fmt::format("desk: quick focal length {:.1f} px, true {:.1f}, from {} views\n", quick.camera()->fx(),
                           camera_.fx(), quick.views());
  EXPECT_NEAR(quick.camera()->fx() / camera_.fx(), 1, 0.01);
}

}  // namespace
}  // namespace mf
