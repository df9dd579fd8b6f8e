// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/session_view.h"

#include <gtest/gtest.h>

namespace mf {
namespace {

using Eigen::Vector3d;

constexpr double mirror_height_m = 0.3;

// A camera 1 m above the world's origin that looks straight down (camera x is world x, y is −y), and mirrors of
// 0.2 × 0.1 m that lie at `mirror_height_m`, facing up, at the given places.
Calibration looking_down(const std::vector<Eigen::Vector2d>& places) {
  Calibration calibration;
  calibration.camera.width = calibration.camera.height = 1000;
  calibration.camera.parameters = {1000, 1000, 500, 500, 0, 0, 0, 0, 0};
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(3.14159265358979, Vector3d::UnitX()));
  calibration.cam_from_world = Rigid3{turned, {0, 0, 1}};
  for (const Eigen::Vector2d& place : places) {
    MirrorPose pose;
    pose.used = true;
    pose.cam_from_mirror =
        *calibration.cam_from_world * Rigid3{Eigen::Quaterniond::Identity(), {place.x(), place.y(), mirror_height_m}};
    calibration.frames.push_back(pose);
  }
  return calibration;
}

MirrorTarget target() {
  MirrorTarget t;
  t.opening_m = {0.2, 0.1};
  return t;
}

PlaneRectangle table() {
  return {{}, {-0.3, -0.3}, {0.3, 0.3}};
}

// The virtual centre lies as far below the mirror as the camera lies above it: at z = 2 · 0.3 − 1.
TEST(SessionView, CentreIsTheCamerasMirrorImage) {
  const auto rays = caught_rays(looking_down({{0.02, 0.01}}), target());
  ASSERT_EQ(rays.size(), 1U);
  EXPECT_TRUE(rays[0].centre.isApprox(Vector3d(0, 0, 2 * mirror_height_m - 1), 1e-9));
}

TEST(SessionView, SeesThePointsBelowTheOpeningAlone) {
  const SessionView view(caught_rays(looking_down({{0, 0}}), target()), table());
  // On the table rays lie nearer to the centre than at the mirror: by (0 + 0.4) / (0.3 + 0.4).
  const double shrink = 0.4 / 0.7;
  EXPECT_EQ(view.seen_at({0.099 * shrink, 0.049 * shrink}).size(), 1U);
  EXPECT_EQ(view.seen_at({0.101 * shrink, 0}).size(), 0U);
  EXPECT_EQ(view.seen_at({0, 0.051 * shrink}).size(), 0U);
  const auto seen = view.seen_at({0.04, 0.02});
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_TRUE(seen[0].direction_in_plane.isApprox(Vector3d(0.04, 0.02, 0.4).normalized(), 1e-9));
}

TEST(SessionView, CountsFramesOverThePlane) {
  Calibration calibration = looking_down({{0, 0}, {0, 0}, {0.2, 0}});
  calibration.frames.push_back(calibration.frames.front());
  calibration.frames.back().used = false;
  const SessionView view(caught_rays(calibration, target()), table());
  EXPECT_EQ(view.frames(), 3U);
  const ImageF counts = view.counts(60, 60);  // cells of 1 cm
  EXPECT_EQ(counts.at(30, 30), 2);
  EXPECT_EQ(counts.at(30 + 11, 30), 1);  // below the third mirror
  EXPECT_EQ(counts.at(30 - 11, 30), 0);
  EXPECT_EQ(counts.at(30, 30 - 4), 0);
}

}  // namespace
}  // namespace mf
