// SPDX-License-Identifier: Apache-2.0
#include "host/render/irradiance.h"

#include <gtest/gtest.h>

#include "host/render/bounce.h"
#include "tests/host/render/scenes.h"

namespace mf {
namespace {

using test::pi;

const ImportanceOptions unrefined{0, 1};

float sum_at(const TriangleMesh& mesh, const LightSet& lights, const SurfacePoint& point, LightSum sum) {
  const RayScene scene(mesh);
  return irradiance_cpu(scene, std::span(&point, 1), lights, sum)[0].x();
}

TEST(Irradiance, OfAConstantHemisphereIsPiTimesItsRadiance) {
  const LightField field = test::constant_field(2500, 2);
  const LightSet lights = make_light_set(field, {});
  const SurfacePoint up = test::facing({0, 0, 0}, {0, 0, 1});
  EXPECT_NEAR(sum_at({}, lights, up, LightSum::visible), 2 * pi, 2 * pi * 1e-3);
  // A wall sees half of it.
  EXPECT_NEAR(sum_at({}, lights, test::facing({0, 0, 0.1F}, {1, 0, 0}), LightSum::visible), pi, pi * 1e-2);
  EXPECT_FLOAT_EQ(sum_at({}, lights, test::facing({0, 0, 0.1F}, {0, 0, -1}), LightSum::visible), 0);
  EXPECT_NEAR(plane_irradiance(field).at(2, 1), 2 * pi, 2 * pi * 1e-3);
}

TEST(Irradiance, OfGroundLightFromBelow) {
  LightSet lights;
  const std::vector<Eigen::Vector4f> texel{{3, 3, 3, 0}};
  append_ground_light(lights, {{-1, -1}, {1, 1}, 1, 1, texel.data()}, 2000);
  EXPECT_NEAR(sum_at({}, lights, test::facing({0, 0, 0.1F}, {0, 0, -1}), LightSum::visible), 3 * pi, 3 * pi * 1e-3);
  EXPECT_NEAR(sum_at({}, lights, test::facing({0, 0, 0.1F}, {0, 1, 0}), LightSum::visible), 1.5 * pi, 1.5 * pi * 1e-2);
}

TEST(Irradiance, ARectangleBlocksItsFormFactor) {
  const LightField field = test::constant_field(10000, 1);
  const LightSet lights = make_light_set(field, unrefined);
  const SurfacePoint ground = test::facing({0.1F, -0.05F, 0}, {0, 0, 1});
  for (const double height : {0.05, 0.1, 0.3}) {
    const TriangleMesh mesh = test::rectangle(0.1F, -0.05F, 0.2F, 0.12F, static_cast<float>(height));
    const double blocked = pi * test::rectangle_form_factor(0.2, 0.12, height);
    EXPECT_NEAR(sum_at(mesh, lights, ground, LightSum::blocked), blocked, 0.01 * pi) << height;
    EXPECT_NEAR(sum_at(mesh, lights, ground, LightSum::visible), pi - blocked, 0.01 * pi) << height;
  }
}

TEST(Irradiance, ASingleDirectionCastsItsShadowWhereItShould) {
  const LightField field = test::constant_field(2500, 1);
  LightSet lights = make_light_set(field, unrefined);
  const Eigen::Vector3f towards = Eigen::Vector3f(1, 0.5F, 2).normalized();
  lights.lights = {{towards, 0.1F, 0}};
  const TriangleMesh mesh = test::rectangle(0, 0, 0.1F, 0.1F, 0.2F);  // its shadow: shifted by (−0.1, −0.05)
  const double lit = 0.1 * towards.z();
  for (const float dx : {-0.051F, -0.049F, 0.F, 0.049F, 0.051F}) {
    const SurfacePoint point = test::facing({-0.1F + dx, -0.05F, 0}, {0, 0, 1});
    const double expected = std::abs(dx) < 0.05F ? 0 : lit;
    EXPECT_NEAR(sum_at(mesh, lights, point, LightSum::visible), expected, 1e-6) << dx;
    EXPECT_NEAR(sum_at(mesh, lights, point, LightSum::blocked), lit - expected, 1e-6) << dx;
  }
}

TEST(Irradiance, ReadsTheTileWhereTheRayCrossesThePlane) {
  LightField field = test::constant_field(42, 0);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)  // radiance 1 + x + 10 y of the texel centre's position
      field.tile(7)[4 * y + x].head<3>().setConstant(1 + (-0.375F + 0.25F * static_cast<float>(x)) +
                                                     10 * (0.375F - 0.25F * static_cast<float>(y)));
  LightSet lights = make_light_set(field, unrefined);
  const Eigen::Vector3f d = field.directions.directions[7];
  const Eigen::Vector3f x(0.05F, -0.1F, 0.04F);
  const Eigen::Vector2f p = x.head<2>() - d.head<2>() * x.z() / d.z();
  ASSERT_LT(p.cwiseAbs().maxCoeff(), 0.375F);
  const float expected = (1 + p.x() + 10 * p.y()) * field.directions.solid_angles_sr[7];
  EXPECT_NEAR(sum_at({}, lights, test::facing(x, d), LightSum::visible), expected, 1e-4);
}

TEST(Irradiance, PointsOfManyPacketsKeepTheirOrder) {
  const LightField field = test::constant_field(300, 1);
  const LightSet lights = make_light_set(field, {});
  const TriangleMesh mesh = test::rectangle(0, 0, 0.2F, 0.2F, 0.1F);
  const RayScene scene(mesh);
  std::vector<SurfacePoint> points;
  points.reserve(2500);
  for (int i = 0; i < 2500; ++i)
    points.push_back(test::facing({0.0004F * static_cast<float>(i - 1250), 0, 0}, {0, 0, 1}));
  const auto all = irradiance_cpu(scene, points, lights, LightSum::visible);
  for (const std::size_t i : {0, 17, 1249, 2047, 2499})
    EXPECT_FLOAT_EQ(all[i].y(), sum_at(mesh, lights, points[i], LightSum::visible)) << i;
}

TEST(LightSet, RefinesTheLampAndKeepsItsEnergy) {
  const Eigen::Vector3f lamp = Eigen::Vector3f(0.4F, 0.3F, 1).normalized();
  const LightField field = test::distant_field(2500, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
    return Eigen::Vector3f::Constant(d.dot(lamp) > std::cos(0.045F) ? 400.F : 0.1F);
  });
  const LightSet plain = make_light_set(field, unrefined);
  const LightSet refined = make_light_set(field, {});
  ASSERT_EQ(plain.lights.size(), field.directions.size());
  EXPECT_GT(refined.lights.size(), plain.lights.size() + 100);
  EXPECT_LT(refined.lights.size(), plain.lights.size() + 1500);
  std::vector<double> by_cell(field.directions.size(), 0);
  for (const DirectionalLight& l : refined.lights) {
    by_cell[l.image] += l.solid_angle_sr;
    EXPECT_NEAR(l.direction.norm(), 1, 1e-5);
    EXPECT_GT(l.direction.z(), 0);
  }
  for (std::size_t i = 0; i < by_cell.size(); ++i)
    EXPECT_NEAR(by_cell[i], field.directions.solid_angles_sr[i], 1e-5) << i;
  const SurfacePoint up = test::facing({0, 0, 0}, {0, 0, 1});
  const float a = sum_at({}, plain, up, LightSum::visible), b = sum_at({}, refined, up, LightSum::visible);
  EXPECT_NEAR(a, b, 2e-3 * a);
}

// Inside a closed cavity of even irradiance E every point gets albedo · E from the walls.
TEST(Bounce, InAFurnaceIsTheAlbedoTimesTheIrradiance) {
  const TriangleMesh cavity = test::sphere({0, 0, 0}, 1, 24, 0.6F, true);
  const RayScene scene(cavity);
  const std::vector<Eigen::Vector3f> even(cavity.positions.size(), Eigen::Vector3f::Constant(2));
  const std::vector<SurfacePoint> points{test::facing({0, 0, 0}, {0, 0, 1}),
                                         test::facing({0.3F, 0.2F, -0.5F}, Eigen::Vector3f(1, 1, 0).normalized())};
  for (const Eigen::Vector3f& e : gather_bounce(cavity, scene, even, points, 2000))
    EXPECT_NEAR(e.z(), 0.6 * 2, 0.01 * 1.2);
}

// A rectangle that shines evenly lights the ground by its form factor.
TEST(Bounce, FallsOffWithTheFormFactor) {
  const TriangleMesh lamp = test::rectangle(0, 0, 0.2F, 0.2F, 0.1F, 1);
  const RayScene scene(lamp);
  const std::vector<Eigen::Vector3f> even(4, Eigen::Vector3f::Constant(1));
  const std::vector<SurfacePoint> below{test::facing({0, 0, 0}, {0, 0, 1})};
  EXPECT_NEAR(gather_bounce(lamp, scene, even, below, 4000)[0].x(), test::rectangle_form_factor(0.2, 0.2, 0.1), 0.01);
}

}  // namespace
}  // namespace mf
