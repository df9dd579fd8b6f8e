// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "host/light_field/resample.h"
#include "tests/support/expect_input_error.h"

namespace mf {
namespace {

using test::contains;
using test::input_error_of;

// A camera 1 m above the world's origin that looks straight down, and mirrors of 0.2 × 0.2 m that lie 0.3 m above the
// ground, at these places along x: every virtual centre is at (0, 0, −0.4).
Calibration looking_down(const std::vector<double>& places) {
  Calibration calibration;
  calibration.camera.width = calibration.camera.height = 1000;
  calibration.camera.parameters = {400, 400, 500, 500, 0, 0, 0, 0, 0};
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  calibration.cam_from_world = Rigid3{turned, {0, 0, 1}};
  for (const double x : places) {
    MirrorPose pose;
    pose.used = true;
    pose.cam_from_mirror = *calibration.cam_from_world * Rigid3{Eigen::Quaterniond::Identity(), {x, 0, 0.3}};
    calibration.frames.push_back(pose);
  }
  return calibration;
}

MirrorTarget mirror() {
  MirrorTarget target;
  target.opening_m = {0.2, 0.2};
  return target;
}

std::string refusal(const Calibration& calibration, double height_m,
                    const std::optional<std::array<double, 4>>& wanted = std::nullopt) {
  return input_error_of([&] { (void)chosen_rectangle(calibration, mirror(), height_m, wanted, "c.json"); });
}

bool is_taken(const Calibration& calibration, double height_m,
              const std::optional<std::array<double, 4>>& wanted = std::nullopt) {
  const PlaneRectangle r = chosen_rectangle(calibration, mirror(), height_m, wanted, "c.json");
  return r.size_m().minCoeff() > 0 && r.world_from_plane.translation.z() == height_m;
}

// At the ground the rays of the middle mirror are 4/7 as far apart as in it.
TEST(ChosenRectangle, IsWhatTheMirrorsCover) {
  const PlaneRectangle r = chosen_rectangle(looking_down({0}), mirror(), 0, std::nullopt, "c.json");
  constexpr double half = 0.1 * 4 / 7, cell = 0.01;
  EXPECT_NEAR(r.max_m.x(), half, cell);
  EXPECT_NEAR(r.min_m.y(), -half, cell);
  const PlaneRectangle wanted = chosen_rectangle(looking_down({0}), mirror(), 0.1, {{0, 0, 1, 2}}, "c.json");
  EXPECT_EQ(wanted.max_m, Eigen::Vector2d(1, 2));
  EXPECT_EQ(wanted.world_from_plane.translation.z(), 0.1);
}

TEST(ChosenRectangle, AHeightInAnotherUnitIsRefused) {
  const Calibration calibration = looking_down({0, 0.1});
  EXPECT_TRUE(is_taken(calibration, 2));
  for (const double height : {50., 80000., -50., 1e30})
    EXPECT_TRUE(contains(refusal(calibration, height), "c.json: --height: ")) << height;
  EXPECT_TRUE(contains(refusal(calibration, 50), "the mirror was waved 0.30 to 0.30 m above the ground"));
}

// Below the virtual centres the rays' lines go on, but no light was caught along them.
TEST(ChosenRectangle, APlaneThatNoViewLooksThroughIsRefused) {
  const Calibration calibration = looking_down({0, 0.1});
  EXPECT_TRUE(is_taken(calibration, -0.3));
  EXPECT_TRUE(contains(refusal(calibration, -0.5), "no mirror view looks through a plane at -0.5 m"));
  const std::string beside = refusal(calibration, 0, {{10, 10, 11, 11}});
  EXPECT_TRUE(contains(beside, "c.json: --rectangle: no mirror view looks through it"));
  EXPECT_TRUE(contains(beside, "they cover -0.0")) << beside;
}

// Two mirrors so far apart that nothing between them is looked through: one of the two places may still be asked for.
TEST(ChosenRectangle, AGivenOneNeedsNoCommonPlace) {
  Calibration calibration = looking_down({-0.7, 0.7});
  calibration.frames[0].cam_from_mirror.translation.y() -= 0.7;  // the camera's y is downwards
  calibration.frames[1].cam_from_mirror.translation.y() += 0.7;
  EXPECT_TRUE(contains(refusal(calibration, 2), "c.json: --height: no mirror view looks through"));
  EXPECT_TRUE(is_taken(calibration, 2, {{2.3, -2.5, 2.5, -2.3}}));
}

TEST(ChosenRectangle, MoreThanIsSearchedIsNotCutOff) {
  const Calibration calibration = looking_down({-0.4, -0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3, 0.4});
  EXPECT_TRUE(is_taken(calibration, 0));
  EXPECT_TRUE(contains(refusal(calibration, 6), "spread over more than 4 × 4 m at 6 m"));
  EXPECT_TRUE(is_taken(calibration, 6, {{-4, -1, 4, 1}}));
}

TEST(ChosenRectangle, NamesWhatTheCalibrationLacks) {
  EXPECT_TRUE(contains(refusal(looking_down({}), 0), "c.json: frames: has no used frame"));
  Calibration calibration = looking_down({0});
  calibration.cam_from_world.reset();
  EXPECT_TRUE(contains(refusal(calibration, 0), "c.json: cam_from_world: is missing"));
}

}  // namespace
}  // namespace mf
