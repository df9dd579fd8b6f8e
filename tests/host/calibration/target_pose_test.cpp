// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/target_pose.h"

#include <gtest/gtest.h>

#include <numbers>

#include "common/robust_homography.h"
#include "common/zhang.h"
#include "tests/host/calibration/synthetic_views.h"

namespace mf {
namespace {

using testing::facing_pose;
using testing::framed_mirror;
using testing::ordinary_camera;
using testing::seen;

CameraModel distorted_camera() {
  CameraModel camera = ordinary_camera();
  camera.parameters[4] = -0.2;
  camera.parameters[5] = 0.1;
  camera.parameters[6] = 1e-3;
  camera.parameters[7] = -7e-4;
  camera.parameters[8] = 0.02;
  return camera;
}

TEST(CornerDerivative, IsTheNumericOne) {
  const CameraModel camera = distorted_camera();
  const Rigid3 pose = facing_pose(1.1, 0.6, 0.8, {0.1, -0.05});
  const Eigen::Vector3d x(0.19, -0.13, 0);
  const std::optional<CornerDerivative> d = corner_derivative(camera, pose, x);
  ASSERT_TRUE(d);
  EXPECT_LT((d->pixel - camera.project(pose * x)).norm(), 1e-9);
  for (int i = 0; i < CameraModel::parameter_count; ++i) {
    CameraModel up = camera, down = camera;
    const double step = i < 4 ? 1e-3 : 1e-6;
    up.parameters[static_cast<std::size_t>(i)] += step;
    down.parameters[static_cast<std::size_t>(i)] -= step;
    const Eigen::Vector2d numeric = (up.project(pose * x) - down.project(pose * x)) / (2 * step);
    EXPECT_LT((d->by_camera.col(i) - numeric).norm(), 1e-5 * (1 + numeric.norm())) << i;
  }
  for (int i = 0; i < 6; ++i) {
    Eigen::Matrix<double, 6, 1> step = Eigen::Matrix<double, 6, 1>::Zero();
    step[i] = 1e-6;
    const Eigen::Vector2d numeric =
        (camera.project(moved(pose, step) * x) - camera.project(moved(pose, -step) * x)) / 2e-6;
    EXPECT_LT((d->by_pose.col(i) - numeric).norm(), 1e-5 * (1 + numeric.norm())) << i;
  }
  EXPECT_FALSE(corner_derivative(camera, pose, {0, 0, 5}));  // behind the camera
}

TEST(EstimatePose, FindsThePoseFromTheWrongTilt) {
  std::mt19937 random(1);
  const CameraModel camera = distorted_camera();
  for (int i = 0; i < 24; ++i) {
    const double axis = 2 * std::numbers::pi * i / 24;
    const Rigid3 truth = facing_pose(1.1, 0.5, axis, {0.02, 0.03});
    const Rigid3 other = facing_pose(1.1, -0.5, axis, {0.02, 0.03});
    const TargetView view = seen(camera, framed_mirror(), truth, 0.1, random);
    const std::optional<PoseEstimate> found = estimate_pose(camera, view, other);
    ASSERT_TRUE(found);
    EXPECT_LT(rotation_angle_between(found->cam_from_target, truth), 1e-3);
    EXPECT_GT(found->mirrored_cost - found->cost, 100) << "a frame of 40 cm is not ambiguous";
  }
}

TEST(EstimatePose, SaysWhenTwoTiltsFitAlike) {
  std::mt19937 random(2);
  const CameraModel camera = ordinary_camera();
  const Rigid3 truth = facing_pose(1.2, 0.5, 0.3, {0, 0});
  TargetView view = seen(camera, framed_mirror(), truth, 0.2, random);
  view.tags.resize(1);
  const std::optional<PoseEstimate> found = estimate_pose(camera, view, truth);
  ASSERT_TRUE(found);
  EXPECT_LT(found->mirrored_cost - found->cost, 12.5);
}

TEST(Zhang, ClosedFormIsExactWithoutNoise) {
  std::mt19937 random(3);
  const CameraModel camera = ordinary_camera();
  std::vector<Homography> homographies;
  for (int i = 0; i < 5; ++i) {
    const TargetView view =
        seen(camera, framed_mirror(), facing_pose(1, 0.3 + 0.05 * i, 1.1 * i, {0.03 * i, 0}), 0, random);
    const std::optional<RobustHomography> h = robust_homography(in_plane(view.tags), 1);
    ASSERT_TRUE(h);
    homographies.push_back(h->picture_from_plane);
    const std::optional<Rigid3> pose = pose_from_homography(h->picture_from_plane, {0, 0, 0}, camera.k_matrix());
    ASSERT_TRUE(pose);
    EXPECT_LT(rotation_angle_between(*pose, facing_pose(1, 0.3 + 0.05 * i, 1.1 * i, {0, 0})), 1e-6);
  }
  const std::optional<CameraModel> found = zhang_intrinsics(homographies, camera.width, camera.height);
  ASSERT_TRUE(found);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(found->parameters[i], camera.parameters[i], 1e-5);
  // A single tilted view: the principal point is assumed, the focal length follows.
  const std::optional<CameraModel> one =
      zhang_intrinsics(std::span(homographies).first(1), camera.width, camera.height);
  ASSERT_TRUE(one);
  EXPECT_NEAR(one->fx(), camera.fx(), 0.1 * camera.fx());
  EXPECT_EQ(one->cx(), 0.5 * camera.width);
}

TEST(RobustHomography, IgnoresTagsReadWrong) {
  std::mt19937 random(4);
  TargetView view = seen(ordinary_camera(), framed_mirror(), facing_pose(1, 0.4, 1, {0, 0}), 0.2, random);
  for (const std::size_t bad : {1U, 7U, 12U, 19U})
    for (Eigen::Vector2d& corner : view.tags[bad].corners_px) corner += Eigen::Vector2d(60, -25);
  const std::optional<RobustHomography> h = robust_homography(in_plane(view.tags), 3);
  ASSERT_TRUE(h);
  for (std::size_t i = 0; i < view.tags.size(); ++i)
    EXPECT_EQ(h->tag_is_inlier[i], i != 1 && i != 7 && i != 12 && i != 19) << i;
  EXPECT_FALSE(robust_homography({}, 3));
}

}  // namespace
}  // namespace mf
