// SPDX-License-Identifier: Apache-2.0
// The two back ends compute one sum: each is the other's reference. Skipped (77) where there is no OpenGL.
#include <gtest/gtest.h>

#include <iostream>

#include "common/error.h"
#include "host/gl/shader_source.h"
#include "host/render/irradiance_gl.h"
#include "tests/host/render/scenes.h"
#include "tests/support/gl_test.h"

namespace mf {
namespace {

using test::pi;

class Backends : public test::GlTest {
 protected:
  std::vector<Eigen::Vector3f> on_gl(const TriangleMesh& mesh, std::span<const SurfacePoint> points,
                                     const LightSet& lights, LightSum sum) {
    return GlIrradiance(*context_, mesh, {}).irradiance(points, lights, sum);
  }
};

// A lamp, a coloured sky, and a different light at every place of the plane.
LightField uneven_field(int directions) {
  const Eigen::Vector3f lamp = Eigen::Vector3f(0.5F, -0.3F, 1).normalized();
  LightField field = test::distant_field(directions, [&](const Eigen::Vector3f& d) -> Eigen::Vector3f {
    const float sky = 0.5F + 0.5F * d.x();
    return Eigen::Vector3f(sky, 0.5F, 1 - sky) + Eigen::Vector3f::Constant(d.dot(lamp) > 0.998F ? 200.F : 0.F);
  });
  for (std::size_t i = 0; i < field.rgbc.size(); ++i) field.rgbc[i].head<3>() *= 1 + 0.05F * static_cast<float>(i % 16);
  return field;
}

// Root mean square of the differences over the mean, without the `worst` share of the points (shadow edges).
double relative_rms(const std::vector<Eigen::Vector3f>& a, const std::vector<Eigen::Vector3f>& b, double worst) {
  std::vector<double> squares;
  double mean = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    squares.push_back((a[i] - b[i]).squaredNorm() / 3);
    mean += b[i].sum() / 3 / static_cast<double>(b.size());
  }
  std::sort(squares.begin(), squares.end());
  squares.resize(squares.size() - static_cast<std::size_t>(worst * static_cast<double>(squares.size())));
  double sum = 0;
  for (const double s : squares) sum += s / static_cast<double>(squares.size());
  return std::sqrt(sum) / mean;
}

std::vector<SurfacePoint> ground_grid(int side, float half) {
  const auto at = [&](int i) { return half * (2 * (static_cast<float>(i) + 0.5F) / static_cast<float>(side) - 1); };
  std::vector<SurfacePoint> points;
  points.reserve(static_cast<std::size_t>(side * side));
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) points.push_back(test::facing({at(x), at(y), 0}, Eigen::Vector3f::UnitZ()));
  return points;
}

// Two spheres, one shading the other and itself not convex as a whole.
TriangleMesh two_spheres() {
  TriangleMesh mesh = test::sphere({0, 0, 0.1F}, 0.08F, 40);
  const TriangleMesh other = test::sphere({0.06F, -0.03F, 0.21F}, 0.05F, 40);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  mesh.normals.insert(mesh.normals.end(), other.normals.begin(), other.normals.end());
  mesh.albedo.insert(mesh.albedo.end(), other.albedo.begin(), other.albedo.end());
  for (const auto& t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return mesh;
}

std::vector<SurfacePoint> centroids(const TriangleMesh& mesh) {
  std::vector<SurfacePoint> points;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
    points.push_back({(a + b + c) / 3, (mesh.normals[t[0]] + mesh.normals[t[1]] + mesh.normals[t[2]]).normalized(),
                      (b - a).cross(c - a).normalized()});
  }
  return points;
}

TEST_F(Backends, AgreeOnTheGroundAndOnTheObject) {
  const LightField field = uneven_field(300);
  const TriangleMesh mesh = two_spheres();
  const RayScene scene(mesh);
  LightSet lights = make_light_set(field, {120, 24});
  const auto ground = ground_grid(96, 0.3F);
  const auto shadow_cpu = irradiance_cpu(scene, ground, lights, LightSum::blocked);
  const auto shadow_gl = on_gl(mesh, ground, lights, LightSum::blocked);
  const auto bare = irradiance_cpu(RayScene(TriangleMesh{}), ground, lights, LightSum::visible);
  std::vector<Eigen::Vector3f> with_cpu, with_gl;
  for (std::size_t i = 0; i < bare.size(); ++i) {
    with_cpu.emplace_back(bare[i] - shadow_cpu[i]);
    with_gl.emplace_back(bare[i] - shadow_gl[i]);
  }
  const double on_ground = relative_rms(with_gl, with_cpu, 0.05);
  EXPECT_LT(on_ground, 0.01);
  EXPECT_GT(relative_rms(with_cpu, bare, 0), 0.05) << "there is a shadow to agree on";

  const std::vector<Eigen::Vector4f> checker{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {1, 1, 1, 0}};
  append_ground_light(lights, {{-0.4F, -0.4F}, {0.4F, 0.4F}, 2, 2, checker.data()}, 100);
  const auto points = centroids(mesh);
  const auto cpu = irradiance_cpu(scene, points, lights, LightSum::visible);
  const auto gl = on_gl(mesh, points, lights, LightSum::visible);
  const double on_object = relative_rms(gl, cpu, 0.05);
  EXPECT_LT(on_object, 0.01);
  std::cout << "gl against cpu, relative RMS: ground " << on_ground << ", object " << on_object << "; "
            << context_->renderer() << "\n";
}

// Points of a lamp that hangs beside the spheres: shadows that spread, a mask that is looked up along each line.
TEST_F(Backends, AgreeOnALampInTheRoom) {
  const TriangleMesh mesh = two_spheres();
  const RayScene scene(mesh);
  std::vector<Eigen::Vector4f> leaf;
  for (int i = 0; i < 32 * 32; ++i)
    leaf.emplace_back(Eigen::Vector4f::Constant((i / 4 + i / 128) % 2 == 0 ? 90.F : 60.F));
  LightSet lights;
  lights.images = {{{-0.4F, -0.4F}, {0.4F, 0.4F}, 32, 32, leaf.data()}};
  for (const float x : {0.28F, 0.32F})
    for (const float y : {0.18F, 0.22F})
      lights.emitter_points.push_back({{x, y, 0.6F}, {0.3F, 0.2F, 0.6F}, 0.04F, 0.25F, 0});
  const auto ground = ground_grid(96, 0.3F);
  const auto cpu = irradiance_cpu(scene, ground, lights, LightSum::blocked);
  EXPECT_LT(relative_rms(on_gl(mesh, ground, lights, LightSum::blocked), cpu, 0.05), 0.02);
  double shadow = 0;
  for (const Eigen::Vector3f& e : cpu) shadow += e.x() > 0 ? 1. / static_cast<double>(cpu.size()) : 0;
  EXPECT_GT(shadow, 0.05) << "there is a shadow to agree on";
  const auto points = centroids(mesh);
  EXPECT_LT(relative_rms(on_gl(mesh, points, lights, LightSum::visible),
                         irradiance_cpu(scene, points, lights, LightSum::visible), 0.05),
            0.01);
}

TEST_F(Backends, GlCastsASingleShadowWhereItShould) {
  const LightField field = test::constant_field(42, 1);
  LightSet lights = make_light_set(field, {0, 1});
  const Eigen::Vector3f towards = Eigen::Vector3f(1, 0.5F, 2).normalized();
  lights.lights = {{towards, 0.1F, 0}};
  const TriangleMesh mesh = test::rectangle(0, 0, 0.1F, 0.1F, 0.2F);  // its shadow: shifted by (−0.1, −0.05)
  std::vector<SurfacePoint> points;
  const std::vector<float> steps{-0.3F, -0.0505F, -0.0495F, 0.F, 0.0495F, 0.0505F, 0.3F};
  points.reserve(steps.size());
  for (const float dx : steps) points.push_back(test::facing({-0.1F + dx, -0.05F, 0}, {0, 0, 1}));
  const auto sums = on_gl(mesh, points, lights, LightSum::visible);
  for (std::size_t i = 0; i < steps.size(); ++i)
    EXPECT_NEAR(sums[i].x(), std::abs(steps[i]) < 0.05F ? 0 : 0.1 * towards.z(), 1e-5) << steps[i];
}

TEST_F(Backends, GlReadsTheTileWhereTheRayCrossesThePlane) {
  LightField field = uneven_field(300);
  const LightSet lights = make_light_set(field, {});
  std::vector<SurfacePoint> points;
  points.reserve(1500);
  for (int i = 0; i < 1500; ++i)  // more than a row of the G-buffer
    points.push_back(test::facing({0.0003F * static_cast<float>(i % 700), 0.1F, 0.0001F * static_cast<float>(i)},
                                  Eigen::Vector3f(0.3F, 0.1F, 1).normalized()));
  const auto cpu = irradiance_cpu(RayScene(TriangleMesh{}), points, lights, LightSum::visible);
  const auto gl = on_gl({}, points, lights, LightSum::visible);
  EXPECT_LT(relative_rms(gl, cpu, 0), 2e-3);
}

TEST_F(Backends, GlAddsThousandsOfDirectionsWithoutLoss) {
  const LightField field = test::constant_field(4000, 1);
  const std::vector<SurfacePoint> points{test::facing({0, 0, 0}, {0, 0, 1})};
  EXPECT_NEAR(on_gl({}, points, make_light_set(field, {0, 1}), LightSum::visible)[0].y(), pi, 2e-4 * pi);
}

TEST(Shaders, AreInTheBinaryWithTheirIncludes) {
  const std::string source = shader_source("accumulate_visible.frag");
  EXPECT_EQ(source.find("#include"), std::string::npos);
  EXPECT_NE(source.find("struct Light"), std::string::npos);
  EXPECT_TRUE(embedded_shader("no_such.frag").empty());
}

}  // namespace
}  // namespace mf
