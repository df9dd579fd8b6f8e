// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/navigation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace mf {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

// At (0, −2, 1), looking along +y at (0, 1, 1).
Navigation example() {
  Eigen::Matrix3d axes;
  axes.col(0) = Vector3d::UnitX();
  axes.col(1) = -Vector3d::UnitZ();
  axes.col(2) = Vector3d::UnitY();
  return {{Eigen::Quaterniond(axes), {0, -2, 1}}, Vector3d::UnitZ(), 3};
}

Vector3d forward(const Navigation& n) {
  return n.world_from_cam.rotation * Vector3d::UnitZ();
}

void expect_near(const Vector3d& a, const Vector3d& b) {
  EXPECT_LT((a - b).norm(), 1e-12) << a.transpose() << " is not " << b.transpose();
}

// Camera x is level, and y points down.
void expect_upright(const Navigation& n) {
  EXPECT_NEAR((n.world_from_cam.rotation * Vector3d::UnitX()).dot(n.up_in_world), 0, 1e-12);
  EXPECT_LT((n.world_from_cam.rotation * Vector3d::UnitY()).dot(n.up_in_world), 0);
}

TEST(Navigation, OrbitsAQuarterToTheRight) {
  const Navigation n = orbited(example(), pi / 2, 0);
  expect_near(n.world_from_cam.translation, {3, 1, 1});
  expect_near(forward(n), {-1, 0, 0});
  expect_near(n.pivot_in_world(), example().pivot_in_world());
  expect_upright(n);
}

TEST(Navigation, OrbitsUpUntilThePole) {
  const Navigation n = orbited(example(), 0, pi / 4);
  expect_near(n.world_from_cam.translation, {0, 1 - 3 * std::sqrt(0.5), 1 + 3 * std::sqrt(0.5)});
  expect_near(n.pivot_in_world(), example().pivot_in_world());
  const Navigation top = orbited(n, 0, 10);
  EXPECT_NEAR(std::acos(-forward(top).z()), closest_to_the_pole_rad, 1e-9);
  expect_near(top.pivot_in_world(), example().pivot_in_world());
  expect_upright(top);
  const Navigation bottom = orbited(n, 0, -10);
  EXPECT_NEAR(std::acos(forward(bottom).z()), closest_to_the_pole_rad, 1e-9);
  expect_upright(bottom);
}

TEST(Navigation, ReturnsFromADragThatGoesBack) {
  Navigation n = example();
  for (int i = 0; i < 100; ++i) n = orbited(n, 0.031, 0.004);
  for (int i = 0; i < 100; ++i) n = orbited(n, -0.031, -0.004);
  EXPECT_LT((n.world_from_cam.translation - example().world_from_cam.translation).norm(), 1e-9);
  EXPECT_LT(rotation_angle_between(n.world_from_cam, example().world_from_cam), 1e-7);
}

TEST(Navigation, TurnsInPlace) {
  const Navigation n = turned(example(), pi / 2, 0);
  expect_near(forward(n), {1, 0, 0});
  expect_near(n.world_from_cam.translation, example().world_from_cam.translation);
  const Navigation up = turned(example(), 0, pi / 6);
  expect_near(forward(up), {0, std::cos(pi / 6), 0.5});
  expect_upright(up);
}

TEST(Navigation, TurnsOnFromStraightDown) {
  Eigen::Matrix3d down;  // the upper edge of the picture is towards +y
  down.col(0) = Vector3d::UnitX();
  down.col(1) = -Vector3d::UnitY();
  down.col(2) = -Vector3d::UnitZ();
  const Navigation n = turned(jumped(example(), {Eigen::Quaterniond(down), {0, 0, 5}}), 0, 0.5);
  expect_near(forward(n), {0, std::sin(0.5), -std::cos(0.5)});
  expect_upright(n);
}

// A photo taken with a tilted hand is not set straight by the first touch.
TEST(Navigation, KeepsAPhotosTilt) {
  Navigation tilted = example();
  tilted.world_from_cam.rotation *= Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Vector3d::UnitZ()));
  EXPECT_LT(rotation_angle_between(turned(tilted, 0, 0).world_from_cam, tilted.world_from_cam), 1e-7);
  const Navigation n = orbited(tilted, 0.7, 0.2);
  EXPECT_NEAR((n.world_from_cam.rotation * Vector3d::UnitX()).dot(n.up_in_world), -std::sin(0.1) * std::cos(0.2), 1e-9);
}

TEST(Navigation, MovesAlongItsOwnAxes) {
  const Navigation n = moved(orbited(example(), pi / 2, 0), {0.5, -0.25, 1});
  expect_near(n.world_from_cam.translation, {3 - 1, 1 + 0.5, 1 + 0.25});
  EXPECT_EQ(n.focus_distance, 3);
}

TEST(Navigation, DolliesTowardsThePivotAndFocusesBeyond) {
  const Navigation nearer = dollied(example(), 0.5);
  expect_near(nearer.world_from_cam.translation, {0, -0.5, 1});
  expect_near(nearer.pivot_in_world(), example().pivot_in_world());
  const Navigation focused = refocused(example(), 2);
  expect_near(focused.world_from_cam.translation, example().world_from_cam.translation);
  expect_near(focused.pivot_in_world(), {0, 4, 1});
}

}  // namespace
}  // namespace mf
