// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/session_view.h"

#include <gtest/gtest.h>

#include "tests/host/viewer/viewer_session.h"

namespace mf {
namespace {

using Eigen::Vector3d;
using test::looking_down;
using test::mirror_height_m;
using test::small_mirror;
using test::table;

// The virtual centre lies as far below the mirror as the camera lies above it: at z = 2 · 0.3 − 1.
TEST(SessionView, CentreIsTheCamerasMirrorImage) {
  const auto rays = caught_rays(looking_down({{0.02, 0.01}}), small_mirror());
  ASSERT_EQ(rays.size(), 1U);
  EXPECT_TRUE(rays[0].centre.isApprox(Vector3d(0, 0, 2 * mirror_height_m - 1), 1e-9));
}

TEST(SessionView, SeesThePointsBelowTheOpeningAlone) {
  const SessionView view(caught_rays(looking_down({{0, 0}}), small_mirror()), table());
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
  const SessionView view(caught_rays(calibration, small_mirror()), table());
  EXPECT_EQ(view.frames(), 3U);
  const ImageF counts = view.counts(60, 60);  // cells of 1 cm
  EXPECT_EQ(counts.at(30, 30), 2);
  EXPECT_EQ(counts.at(30 + 11, 30), 1);  // below the third mirror
  EXPECT_EQ(counts.at(30 - 11, 30), 0);
  EXPECT_EQ(counts.at(30, 30 - 4), 0);
}

}  // namespace
}  // namespace mf
