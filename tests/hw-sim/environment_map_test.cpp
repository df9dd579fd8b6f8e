// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/environment_map.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "hw-sim/desk_rig.h"
#include "tests/support/expect_input_error.h"

namespace mf::sim {
namespace {

// Dim, but for one bright spot of a few pixels to the left of +Y, 45° up.
EnvironmentMap spot() {
  ImageF panorama(128, 64, 3, 0.1F);
  for (int y = 15; y < 18; ++y)
    for (int x = 47; x < 50; ++x)
      for (int c = 0; c < 3; ++c) panorama.at(x, y, c) = 500;
  return EnvironmentMap(std::move(panorama));
}

TEST(EnvironmentMap, DirectionsFollowTheConvention) {
  ImageF panorama(64, 32, 3, 0.0F);
  panorama.at(32, 16, 0) = panorama.at(31, 16, 0) = panorama.at(32, 15, 0) = panorama.at(31, 15, 0) = 1;  // centre
  panorama.at(16, 16, 1) = panorama.at(15, 16, 1) = panorama.at(16, 15, 1) = panorama.at(15, 15, 1) =
      1;                                                  // a quarter left
  for (int x = 0; x < 64; ++x) panorama.at(x, 0, 2) = 1;  // top
  const EnvironmentMap map(std::move(panorama));
  EXPECT_NEAR(map.radiance({0, 1, 0})[0], 1, 1e-4);
  EXPECT_NEAR(map.radiance({-1, 0, 0})[1], 1, 1e-4);
  EXPECT_NEAR(map.radiance({0, 0, 1})[2], 1, 1e-4);
}

// The density is that of what is drawn: its reciprocal integrates to the sphere, and the light to the map's own sum.
TEST(EnvironmentMap, DrawsIntegrateToTheSphereAndTheLight) {
  const EnvironmentMap map = spot();
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform;
  double light = 0, upper = 0;
  constexpr int draws = 200'000;
  for (int i = 0; i < draws; ++i) {
    const EnvironmentMap::Drawn d = map.draw({uniform(random), uniform(random)});
    ASSERT_NEAR(d.direction.norm(), 1, 1e-4);
    ASSERT_GT(d.density, 0);
    light += static_cast<double>(d.radiance[0] / d.density) / draws;
    if (d.direction.z() > 0) upper += static_cast<double>(d.radiance[0] / d.density) / draws;
  }
  double expected = 0, expected_upper = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 128; ++x) {
      const bool bright = y >= 15 && y < 18 && x >= 47 && x < 50;
      const double angle = 2 * std::numbers::pi / 128 *
                           (std::cos(y * std::numbers::pi / 64) - std::cos((y + 1) * std::numbers::pi / 64));
      expected += (bright ? 500 : 0.1) * angle;
      if (y < 32) expected_upper += (bright ? 500 : 0.1) * angle;
    }
  EXPECT_NEAR(light, expected, 0.002 * expected);
  EXPECT_NEAR(upper, expected_upper, 0.005 * expected_upper);
}

// A white table under the map is as bright as the integral of the map's light over its hemisphere says.
TEST(EnvironmentMap, LightsTheTableByItsIrradiance) {
  Scene scene;
  scene.surfaces.push_back(
      {{{{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, {{0, 1, 2}, {0, 2, 3}}}, PlainPaint{Rgb::Constant(0.5F)}});
  scene.lamp = {{0, 0, 50}, 0.01F, Rgb::Zero()};
  scene.panorama = std::make_shared<EnvironmentMap>(spot());
  const Tracer tracer(scene, nullptr);
  Sampler sampler(1);
  double sum = 0;
  constexpr int rays = 20'000;
  for (int i = 0; i < rays; ++i) {
    sampler.start_sample(i);
    sum += static_cast<double>(tracer.radiance({{0, 0, 1}, {0, 0, -1}}, std::nullopt, sampler)[0]) / rays;
  }
  double irradiance = 0;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 128; ++x) {
      const bool bright = y >= 15 && y < 18 && x >= 47 && x < 50;
      const double from = y * std::numbers::pi / 64, to = (y + 1) * std::numbers::pi / 64;
      irradiance += (bright ? 500 : 0.1) * 2 * std::numbers::pi / 128 *
                    (std::sin(to) * std::sin(to) - std::sin(from) * std::sin(from)) / 2;
    }
  EXPECT_NEAR(sum, 0.5 / std::numbers::pi * irradiance, 0.01 * sum);
}

TEST(EnvironmentMap, WhatIsNoPanoramaIsNamed) {
  EXPECT_NE(test::input_error_of([] { (void)read_environment_map("/nowhere.exr"); }).find("/nowhere.exr"),
            std::string::npos);
}

}  // namespace
}  // namespace mf::sim
