// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/proxy_rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "host/lumigraph/source_sight.h"

namespace mf {
namespace {

TriangleMesh ball_mesh(const Eigen::Vector3f& centre, float radius, std::uint32_t steps) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i <= steps; ++i)
    for (std::uint32_t j = 0; j <= steps; ++j) {
      const float theta = std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(steps);
      const float phi = 2 * std::numbers::pi_v<float> * static_cast<float>(j) / static_cast<float>(steps);
      const Eigen::Vector3f n(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      mesh.positions.push_back(centre + radius * n);
      mesh.normals.push_back(n);
      mesh.albedo.push_back(Eigen::Vector3f::Zero());
    }
  for (std::uint32_t i = 0; i < steps; ++i)
    for (std::uint32_t j = 0; j < steps; ++j) {
      const std::uint32_t a = i * (steps + 1) + j;
      mesh.triangles.push_back({a, a + steps + 1, a + 1});
      mesh.triangles.push_back({a + 1, a + steps + 1, a + steps + 2});
    }
  return mesh;
}

std::vector<float> distances(const Proxy& proxy, const Eigen::Vector3f& origin,
                             const std::vector<Eigen::Vector3f>& rays) {
  std::array<std::vector<float>, 7> v;
  v.fill(std::vector<float>(rays.size()));
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) v[c][i] = rays[i][static_cast<Eigen::Index>(c)];
  trace(proxy, {origin, v[0], v[1], v[2], v[3], v[4], v[5], v[6]});
  return v[3];
}

// From inside or outside, a ray meets the wall that it crosses last, as the sphere's does; a view beyond a wall looks
// through it.
TEST(ProxyRays, AMeshThatSurroundsIsMetLikeTheSphere) {
  const Eigen::Vector3f centre(1, -0.5F, 0.3F);
  const Proxy walls = MeshProxy(ball_mesh(centre, 2, 200), true);
  const Proxy sphere = SphereProxy{centre, 2};
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::vector<Eigen::Vector3f> rays;
  for (int i = 0; i < 500; ++i) rays.emplace_back(normal(random), normal(random), normal(random));
  for (const Eigen::Vector3f& origin : {Eigen::Vector3f(1.2F, 0, 0), Eigen::Vector3f(1, -3.5F, 0.5F)}) {
    const std::vector<float> of_walls = distances(walls, origin, rays);
    const std::vector<float> of_sphere = distances(sphere, origin, rays);
    int met = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Eigen::Vector3f middle = origin + rays[i] * (centre - origin).dot(rays[i]) / rays[i].squaredNorm();
      if (std::abs((middle - centre).norm() - 2) < 0.05F) continue;  // a grazing ray: the mesh is not quite the sphere
      ASSERT_EQ(std::isfinite(of_walls[i]), std::isfinite(of_sphere[i])) << i;
      if (!std::isfinite(of_walls[i])) continue;
      ++met;
      EXPECT_NEAR(of_walls[i] * rays[i].norm(), of_sphere[i] * rays[i].norm(), 0.01F) << i;
    }
    EXPECT_GT(met, 20);
  }
}

TEST(ProxyRays, AMeshThatSurroundsHidesNothing) {
  CameraModel camera;
  camera.width = camera.height = 32;
  camera.parameters = {30, 30, 16, 16, 0, 0, 0, 0, 0};
  const TriangleMesh mesh = ball_mesh(Eigen::Vector3f::Zero(), 2, 20);
  EXPECT_TRUE(make_sight(camera, {}, {}, MeshProxy(mesh, true), {}).empty());
  EXPECT_FALSE(make_sight(camera, {}, {}, MeshProxy(mesh), {}).empty());
}

}  // namespace
}  // namespace mf
