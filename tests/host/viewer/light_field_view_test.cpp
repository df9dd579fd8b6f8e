// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/light_field_view.h"

#include <gtest/gtest.h>

#include "tests/host/viewer/viewer_fields.h"

namespace mf {
namespace {

using Eigen::Vector2d;
using test::lamp_field;

// Fractions of the disc where the lamp of lamp_field() is.
Vector2d lamp_position() {
  return equal_area_square({0.6F, 0, 0.8F}).cast<double>();
}

float red_at(const ImageF& picture, const Vector2d& position) {
  return picture.at(static_cast<int>(position.x() * picture.width), static_cast<int>(position.y() * picture.height));
}

TEST(LightFieldView, ShowsTheLampWhereItIs) {
  LightFieldView view(lamp_field());
  const ImageF& disc = view.hemisphere(64);
  EXPECT_FLOAT_EQ(red_at(disc, {1 - lamp_position().x(), 0.5}), 0);
  EXPECT_EQ(disc.at(0, 0, 2), 0);  // outside the disc
  EXPECT_FLOAT_EQ(disc.at(32, 32, 2), 0.25F);
  EXPECT_NEAR(red_at(disc, lamp_position()), 6, 0.01);  // the plane's middle: halfway from 4 to 8
}

TEST(LightFieldView, ReadsThePlaceUnderTheProbe) {
  LightFieldView view(lamp_field());
  view.move_probe({-0.2, 0});
  EXPECT_NEAR(red_at(view.hemisphere(64), lamp_position()), 4, 0.01);
  view.move_probe({5, -7});  // kept inside
  EXPECT_EQ(view.probe_in_plane(), Vector2d(0.2, -0.2));
  EXPECT_NEAR(red_at(view.hemisphere(64), lamp_position()), 8, 0.01);
}

// Higher up, light from the right crosses the plane farther left: the ray towards the lamp goes down by 0.1 m and left
// by 0.075 m, where its radiance is less by 0.075 / 0.35 · 4 (0.35 m lie between the outer texels' centres).
TEST(LightFieldView, FollowsRaysFromAboveThePlane) {
  LightFieldView view(lamp_field());
  view.set_height(0.1);
  EXPECT_NEAR(view.probe_in_world().z(), 0.2, 1e-12);
  EXPECT_NEAR(red_at(view.hemisphere(256), lamp_position()), 6 - 0.075 / 0.35 * 4, 0.03);
}

TEST(LightFieldView, IrradianceGrowsToTheRight) {
  const LightFieldView view(lamp_field());
  const float left = view.irradiance_at({-0.2, 0}).x(), right = view.irradiance_at({0.2, 0}).x();
  EXPECT_NEAR(right / left, 2, 1e-3);
  // The lamp's cap of 0.35 rad seen under a cosine of 0.8; the cells' rim makes it a little uneven.
  EXPECT_NEAR(left, 4 * 0.8 * 3.14159 * std::pow(std::sin(0.35), 2), 0.1);
}

TEST(LightFieldView, PlanePositionsAreFractionsFromTheUpperLeft) {
  const LightFieldView view(lamp_field());
  EXPECT_TRUE(view.plane_point({0, 0}).isApprox(Vector2d(-0.2, 0.2)));
  EXPECT_TRUE(view.plane_position({-0.1, 0.1}).isApprox(Vector2d(0.25, 0.25)));
  EXPECT_TRUE(view.plane_position(view.plane_point({0.3, 0.9})).isApprox(Vector2d(0.3, 0.9)));
}

TEST(LightFieldView, DistancesAreThePointsOwn) {
  LightFieldView view(lamp_field());
  EXPECT_NEAR(view.inverse_distances(32).at(16, 16), 0.5, 1e-3);
  view.set_height(1);
  EXPECT_NEAR(view.inverse_distances(32).at(16, 16), 1, 1e-2);  // the sphere's top is 1 m above
  const auto zenith = view.read_disc({0.5, 0.5});
  ASSERT_TRUE(zenith && zenith->inverse_distance);
  EXPECT_NEAR(*zenith->inverse_distance, 1, 1e-5);
  const ImageU8 shown = show_inverse_distances(view.inverse_distances(32), 2);
  EXPECT_EQ(shown.at(16, 16), 255);
  EXPECT_EQ(shown.at(0, 0), 0);
}

TEST(LightFieldView, AFieldFocusedOnItsPlaneKnowsNoDistance) {
  LightField field = lamp_field();
  field.surroundings = {};
  LightFieldView view(std::move(field));
  EXPECT_TRUE(view.inverse_distances(32).empty());
  EXPECT_FALSE(view.read_disc({0.5, 0.5})->inverse_distance);
}

// Panorama: world +Y in its middle, so +X is a quarter to the right.
TEST(LightFieldView, PanoramaAndDiscReadTheSameLight) {
  LightFieldView view(lamp_field());
  const double elevation = std::asin(0.8);
  const Vector2d lamp(0.75, 0.5 - elevation / 3.14159265);
  const auto in_panorama = view.read_panorama(lamp);
  const auto in_disc = view.read_disc(lamp_position());
  ASSERT_TRUE(in_panorama && in_disc);
  EXPECT_LT((in_panorama->direction_in_world - in_disc->direction_in_world).norm(), 2e-3);
  EXPECT_NEAR(in_panorama->radiance.x(), in_disc->radiance.x(), 0.02);
  EXPECT_NEAR(red_at(view.panorama(128), lamp), 6, 0.05);
  EXPECT_FALSE(view.read_panorama({0.5, 0.8}));
  EXPECT_FALSE(view.read_disc({0.02, 0.02}));
}

TEST(LightFieldView, DescribesADirection) {
  EXPECT_EQ(describe({{0, 0.8, 0.6}, {1, 0.5, 0.25, 1}, 0.4}), "azimuth 90°, elevation 37°: 1 0.5 0.25, 2.50 m away");
  EXPECT_EQ(describe({{-0.8, 0, 0.6}, {1, 0.5, 0.25, 1}, 0.0}), "azimuth 180°, elevation 37°: 1 0.5 0.25, distant");
  EXPECT_EQ(describe({{0, 0, 1}, {0, 0, 0, 0}, std::nullopt}), "azimuth 0°, elevation 90°: no view looked there");
}

}  // namespace
}  // namespace mf
