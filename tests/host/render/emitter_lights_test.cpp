// SPDX-License-Identifier: Apache-2.0
#include "host/render/emitter_lights.h"

#include <gtest/gtest.h>

#include "host/render/irradiance.h"
#include "host/tracing/ray_scene.h"
#include "tests/host/render/scenes.h"

namespace mf {
namespace {

using test::pi;

// A lamp, and a board half way up that hides it from the half of the plane with x > 0: its shadow's edge lies at x = 0
// for the lamp's centre.
LightField lamp_beside_a_board() {
  LightField field;
  field.directions = geodesic_hemisphere(100);
  field.plane.min_m = {-0.5, -0.5};
  field.plane.max_m = {0.5, 0.5};
  ShadedEmitter e;
  e.emitter = {{0, 0.1F, 0.8F}, 0.05F, 9};
  e.radiance = {500, 400, 300};
  e.occluder_share = 0.5F;
  e.mask_min_m = {-0.6F, -0.6F};
  e.mask_max_m = {0.6F, 0.6F};
  e.mask = ImageF(240, 240, 3);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 240; ++x) {
      e.mask.at(x, y, 0) = x < 120 ? 1.F : 0.F;
      e.mask.at(x, y, 1) = 1;
      e.mask.at(x, y, 2) = 0.5F;
    }
  field.emitters.push_back(e);
  return field;
}

const Bounds object{{-0.1F, -0.1F, 0.05F}, {0.1F, 0.1F, 0.2F}, {0, 0, 0.12F}, 0.16F};

Eigen::Vector3f light_at(const Eigen::Vector3f& x, const Eigen::Vector3f& n, bool plane) {
  const LightField field = lamp_beside_a_board();
  const EmitterLights lights = emitter_lights(field, object, plane, 64);
  LightSet set;
  append_emitters(set, lights);
  return irradiance_cpu(RayScene(TriangleMesh{}), std::vector{test::facing(x, n)}, set, LightSum::visible)[0];
}

TEST(EmitterLights, BringWhatABallOfTheirRadianceBrings) {
  const Eigen::Vector3f lamp(0, 0.1F, 0.8F);
  for (const bool plane : {false, true})
    for (const Eigen::Vector3f& x : {Eigen::Vector3f(-0.1F, 0.05F, 0.06F), Eigen::Vector3f(-0.09F, -0.1F, 0.2F)}) {
      const Eigen::Vector3f to = lamp - x;
      const double expected = pi * 0.05 * 0.05 / static_cast<double>(to.squaredNorm());  // a ball's, facing it
      const Eigen::Vector3f e = light_at(x, to.normalized(), plane);
      EXPECT_NEAR(e.x(), 500 * expected, 0.01 * 500 * expected);
      EXPECT_NEAR(e.z(), 300 * expected, 0.01 * 300 * expected);
    }
}

// A ball half hidden gives half: where the line from its centre meets the board's edge, and to both sides of that as
// wide as the lamp is beyond the board.
TEST(EmitterLights, AreHiddenAsTheMaskSays) {
  const auto share = [](float x) {
    const Eigen::Vector3f at(x, 0.1F, 0);
    return light_at(at, Eigen::Vector3f::UnitZ(), true).x() /
           light_at({-0.3F, 0.1F, 0}, Eigen::Vector3f::UnitZ(), true).x();
  };
  EXPECT_NEAR(share(0), 0.5 * std::pow(0.73 / 0.64, 2), 0.04);  // nearer, and cos⁴
  EXPECT_GT(share(-0.06F), 1);
  EXPECT_EQ(share(0.06F), 0);
}

TEST(EmitterLights, LightNothingAboveThem) {
  EXPECT_EQ(light_at({-0.1F, 0, 0.9F}, Eigen::Vector3f::UnitZ(), true).norm(), 0);
  EXPECT_EQ(light_at({-0.1F, 0, 0.9F}, -Eigen::Vector3f::UnitZ(), true).norm(), 0);
}

// On the bare plane the one-point sum is the same light.
TEST(EmitterLights, LightTheBarePlane) {
  const LightField field = lamp_beside_a_board();
  const EmitterLights lights = emitter_lights(field, object, true, 64);
  LightSet set;
  append_emitters(set, lights);
  for (const float x : {-0.3F, -0.02F, 0.01F})
    EXPECT_NEAR(emitted_irradiance(set, {x, 0.2F}).y(), light_at({x, 0.2F, 0}, Eigen::Vector3f::UnitZ(), true).y(),
                1e-4F * emitted_irradiance(set, {-0.3F, 0.2F}).y());
}

}  // namespace
}  // namespace mf
