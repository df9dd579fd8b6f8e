// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/calibrate.h"

#include <gtest/gtest.h>

#include <numbers>

#include "common/error.h"
#include "tests/host/calibration/synthetic_views.h"

namespace mf {
namespace {

using testing::facing_pose;
using testing::framed_mirror;
using testing::ordinary_camera;
using testing::seen;
using testing::synthetic_capture;
using testing::SyntheticCapture;

constexpr double degrees = std::numbers::pi / 180;

double position_error(const Rigid3& a, const Rigid3& b) {
  return (a.translation - b.translation).norm();
}

TEST(Calibrate, RecoversCameraPosesAndWorldFromNoisyCorners) {
  const SyntheticCapture capture = synthetic_capture(ordinary_camera(), 40, 0.1, 1);
  const CalibrationResult result = calibrate(capture.input, {}, {});
  const Calibration& c = result.calibration;
  EXPECT_NEAR(c.camera.fx(), capture.camera.fx(), 5e-4 * capture.camera.fx());
  EXPECT_NEAR(c.camera.fy(), capture.camera.fy(), 5e-4 * capture.camera.fy());
  EXPECT_NEAR(c.camera.cx(), capture.camera.cx(), 0.3);
  EXPECT_NEAR(c.camera.cy(), capture.camera.cy(), 0.3);
  EXPECT_FALSE(c.camera.has_distortion()) << "nothing in these pictures shows any";
  EXPECT_NEAR(c.rms_px, 0.1 * std::numbers::sqrt2, 0.01);
  ASSERT_EQ(c.frames.size(), capture.cam_from_mirror.size());
  for (std::size_t i = 0; i < c.frames.size(); ++i) {
    ASSERT_TRUE(c.frames[i].used) << c.frames[i].why_not;
    EXPECT_LT(rotation_angle_between(c.frames[i].cam_from_mirror, capture.cam_from_mirror[i]), 0.05 * degrees);
    EXPECT_LT(position_error(c.frames[i].cam_from_mirror, capture.cam_from_mirror[i]), 1e-3);
  }
  ASSERT_TRUE(c.cam_from_world.has_value());
  EXPECT_LT(rotation_angle_between(*c.cam_from_world, capture.cam_from_world), 0.1 * degrees);
  EXPECT_LT(position_error(*c.cam_from_world, capture.cam_from_world), 2e-3);
}

TEST(Calibrate, RecoversLensDistortion) {
  CameraModel camera = ordinary_camera();
  camera.parameters[4] = -0.21;
  camera.parameters[5] = 0.12;
  camera.parameters[6] = 8e-4;
  camera.parameters[7] = -5e-4;
  const SyntheticCapture capture = synthetic_capture(camera, 60, 0.1, 2);
  const Calibration c = calibrate(capture.input, {}, {}).calibration;
  EXPECT_NEAR(c.camera.fx(), camera.fx(), 1e-3 * camera.fx());
  EXPECT_NEAR(c.camera.cx(), camera.cx(), 0.7);
  EXPECT_NEAR(c.camera.cy(), camera.cy(), 0.7);
  EXPECT_NEAR(c.rms_px, 0.1 * std::numbers::sqrt2, 0.01);
  // What the terms do at the picture's corner counts, not each of them.
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(40, 40), Eigen::Vector2d(700, 40), Eigen::Vector2d(60, 600)}) {
    const Eigen::Vector3d ray = *camera.unproject(pixel);
    EXPECT_LT((c.camera.project(ray) - pixel).norm(), 0.8) << pixel.transpose();
  }
}

TEST(Calibrate, MarksTagsThatWereReadWrong) {
  SyntheticCapture capture = synthetic_capture(ordinary_camera(), 30, 0.1, 3);
  int spoiled = 0;
  for (std::size_t i = 0; i < capture.input.mirror.size(); i += 2) {
    std::vector<TagSighting>& tags = capture.input.mirror[i].tags;
    std::swap(tags[3].corners_px, tags[20].corners_px);                                   // far away
    for (Eigen::Vector2d& corner : tags[10].corners_px) corner += Eigen::Vector2d(2, 1);  // a near miss
    spoiled += 3;
  }
  const CalibrationResult result = calibrate(capture.input, {}, {});
  EXPECT_EQ(result.outlier_tags, spoiled);
  EXPECT_NEAR(result.calibration.camera.fx(), capture.camera.fx(), 5e-4 * capture.camera.fx());
  for (std::size_t i = 0; i < capture.cam_from_mirror.size(); ++i) {
    const MirrorPose& frame = result.calibration.frames[i];
    ASSERT_TRUE(frame.used) << frame.why_not;
    EXPECT_EQ(frame.outlier_corners, i % 2 == 0 ? 12 : 0);
    EXPECT_LT(rotation_angle_between(frame.cam_from_mirror, capture.cam_from_mirror[i]), 0.05 * degrees);
  }
}

// One standard deviation holds 68 % of normal errors; here in three dimensions: the mean squared error over the
// variance is 1.
TEST(Calibrate, UncertaintiesAreWhatTheErrorsAre) {
  double rotation = 0, position = 0, focal = 0;
  int count = 0;
  constexpr int trials = 12;
  for (unsigned seed = 0; seed < trials; ++seed) {
    const SyntheticCapture capture = synthetic_capture(ordinary_camera(), 15, 0.2, 100 + seed);
    CalibrationOptions options;
    options.distortion = DistortionChoice::none;
    options.model_error_px = 1e-3;
    const Calibration c = calibrate(capture.input, options, {}).calibration;
    focal += std::pow((c.camera.fx() - capture.camera.fx()) / c.camera_sigma[0], 2);
    for (std::size_t i = 0; i < c.frames.size(); ++i) {
      const MirrorPose& frame = c.frames[i];
      if (!frame.used) continue;
      rotation += std::pow(
          rotation_angle_between(frame.cam_from_mirror, capture.cam_from_mirror[i]) / frame.rotation_sigma_rad, 2);
      position +=
          std::pow(position_error(frame.cam_from_mirror, capture.cam_from_mirror[i]) / frame.position_sigma_m, 2);
      ++count;
    }
  }
  ASSERT_GT(count, 100);
  EXPECT_NEAR(rotation / count, 1, 0.35);
  EXPECT_NEAR(position / count, 1, 0.6);  // frames of one capture share the focal length's error
  EXPECT_GT(focal / trials, 0.3);
  EXPECT_LT(focal / trials, 2.2);
}

TEST(Calibrate, ListsFramesThatCannotBePosed) {
  SyntheticCapture capture = synthetic_capture(ordinary_camera(), 12, 0.1, 4);
  capture.input.mirror[2].tags.clear();
  // One tag of 34 mm, 1 m away: its tilt is open by degrees, and two tilts fit alike.
  capture.input.mirror[5].tags.resize(1);
  for (TagSighting& tag : capture.input.mirror[7].tags)
    for (Eigen::Vector2d& corner : tag.corners_px) std::swap(corner.x(), corner.y());  // seen mirrored
  const Calibration c = calibrate(capture.input, {}, {}).calibration;
  for (std::size_t i = 0; i < c.frames.size(); ++i) {
    const bool bad = i == 2 || i == 5 || i == 7;
    EXPECT_EQ(c.frames[i].used, !bad) << i;
    EXPECT_EQ(c.frames[i].why_not.empty(), !bad) << i;
  }
  EXPECT_EQ(c.frames[2].why_not, "no tag found");
}

TEST(Calibrate, RefusesWhatCannotFixTheCamera) {
  SyntheticCapture capture = synthetic_capture(ordinary_camera(), 10, 0.1, 5);
  CalibrationInput empty = capture.input;
  for (TargetView& view : empty.mirror) view.tags.clear();
  empty.world.tags.clear();
  EXPECT_THROW((void)calibrate(empty, {}, {}), InputError);
  // Every mirror faces the camera: distance and focal length cannot be told apart.
  CalibrationInput facing = capture.input;
  facing.world.tags.clear();
  std::mt19937 random(6);
  for (std::size_t i = 0; i < facing.mirror.size(); ++i)
    facing.mirror[i].tags =
        seen(capture.camera, framed_mirror(), facing_pose(0.8 + 0.05 * static_cast<double>(i), 0, 0, {0, 0}), 0, random)
            .tags;
  for (TargetView& view : facing.mirror)
    for (TagSighting& tag : view.tags) tag.information = isotropic_information(0.1);
  EXPECT_THROW((void)calibrate(facing, {}, {}), InputError);
}

TEST(CalibrationOptions, AreValidated) {
  EXPECT_FALSE(CalibrationOptions{}.validate());
  CalibrationOptions options;
  options.max_rotation_sigma_deg = 0;
  EXPECT_TRUE(options.validate());
  options = {};
  options.model_error_px = -1;
  EXPECT_TRUE(options.validate());
}

}  // namespace
}  // namespace mf
