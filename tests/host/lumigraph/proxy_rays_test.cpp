// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/proxy_rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

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

// From inside or outside, a ray meets the wall that it leaves through, as the sphere's does; a view beyond a wall looks
// through it.
TEST(ProxyRays, AMeshThatSurroundsIsMetLikeTheSphere) {
  const Eigen::Vector3f centre(1, -0.5F, 0.3F);
  const Proxy walls =
      MeshProxy(ball_mesh(centre, 2, 200), Eigen::Vector3f(centre + Eigen::Vector3f(0.5F, 0.3F, -0.2F)));
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

// A lamp that hangs in the room is met before the wall behind it, from anywhere inside.
TEST(ProxyRays, WhatStandsBeforeAWallIsMetFirst) {
  TriangleMesh room = ball_mesh(Eigen::Vector3f::Zero(), 4, 100);
  const TriangleMesh lamp = ball_mesh({0, 0, 2}, 0.3F, 60);
  const auto first = static_cast<std::uint32_t>(room.positions.size());
  room.positions.insert(room.positions.end(), lamp.positions.begin(), lamp.positions.end());
  room.normals.insert(room.normals.end(), lamp.normals.begin(), lamp.normals.end());
  room.albedo.insert(room.albedo.end(), lamp.albedo.begin(), lamp.albedo.end());
  for (const auto& [a, b, c] : lamp.triangles) room.triangles.push_back({a + first, b + first, c + first});
  const Proxy walls = MeshProxy(std::move(room), Eigen::Vector3f(0, 0, 0));
  EXPECT_NEAR(distances(walls, {0, 0, 0}, {Eigen::Vector3f(0, 0, 1)})[0], 1.7F, 0.01F);
  EXPECT_NEAR(distances(walls, {0, 0, -6}, {Eigen::Vector3f(0, 0, 1)})[0], 7.7F, 0.01F);  // through the near wall
  EXPECT_NEAR(distances(walls, {0, 0, 0}, {Eigen::Vector3f(1, 0, 0)})[0], 4, 0.01F);
}

}  // namespace
}  // namespace mf
