// SPDX-License-Identifier: Apache-2.0
#include "common/virtual_view.h"

#include <gtest/gtest.h>

namespace mf {
namespace {

const CameraModel camera{800, 600, {900, 900, 400, 300, 0, 0, 0, 0, 0}};
const MirrorTarget target{"tag36h11", {0.3, 0.2}, {{0, 0.03, {0.2, 0.2}}}};

// A mirror one metre ahead, tilted, its reflecting side towards the camera.
Rigid3 tilted_mirror() {
  const Eigen::Quaterniond facing(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.3, 1, 0).normalized())) * facing,
          {0.05, -0.02, 1}};
}

// Snell: the light path point → mirror → camera obeys the law of reflection at the pixel where the point is seen.
TEST(VirtualView, ObeysTheLawOfReflection) {
  const Rigid3 cam_from_mirror = tilted_mirror();
  const auto view = mirror_view(cam_from_mirror, target, camera);
  ASSERT_TRUE(view.has_value());
  const Eigen::Vector3d point_in_cam = cam_from_mirror * Eigen::Vector3d(0.2, -0.1, 0.7);  // on the reflecting side
  const Eigen::Vector3d seen = view->reflected(point_in_cam);
  const Eigen::Vector3d normal = cam_from_mirror.rotation * Eigen::Vector3d::UnitZ();
  const double t = normal.dot(cam_from_mirror.translation) / normal.dot(seen);
  const Eigen::Vector3d on_mirror = t * seen;
  ASSERT_GT(t, 0);
  ASSERT_LT(t, 1);  // the mirror is met before the point's image behind it
  const Eigen::Vector3d in = (point_in_cam - on_mirror).normalized(), out = -on_mirror.normalized();
  EXPECT_NEAR(in.dot(normal), out.dot(normal), 1e-12);
  EXPECT_LT((in + out - 2 * in.dot(normal) * normal).norm(), 1e-12);
}

TEST(VirtualView, CentreIsTheCamerasMirrorImage) {
  const Rigid3 cam_from_mirror = tilted_mirror();
  const auto view = mirror_view(cam_from_mirror, target, camera);
  ASSERT_TRUE(view.has_value());
  const Eigen::Vector3d camera_in_mirror = cam_from_mirror.inverse().translation;
  const Eigen::Vector3d expected =
      cam_from_mirror * Eigen::Vector3d(camera_in_mirror.x(), camera_in_mirror.y(), -camera_in_mirror.z());
  EXPECT_LT((view->centre_in_cam() - expected).norm(), 1e-12);
  EXPECT_EQ(view->opening_in_img.size(), 4u);
}

TEST(VirtualView, NothingFromBehind) {
  Rigid3 away = tilted_mirror();
  away.rotation = away.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  EXPECT_FALSE(mirror_view(away, target, camera).has_value());
}

}  // namespace
}  // namespace mf
