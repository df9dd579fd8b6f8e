// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/view_bounds.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "host/lumigraph/proxy_rays.h"
#include "host/lumigraph/tile_renderer.h"
#include "tests/host/lumigraph/made_photos.h"

namespace mf {
namespace {

constexpr float tolerance = 0.01F;

// 8 × 8 rays about a pixel of the view; nothing when one misses.
std::optional<TileRays> bundle_at(const View& view, const Proxy& proxy, int x0, int y0) {
  const Rigid3 world_from_cam = view.cam_from_world.inverse();
  TileRays rays;
  rays.resize(largest_bundle);
  for (std::size_t i = 0; i < largest_bundle; ++i) {
    const Eigen::Vector2d pixel(x0 + static_cast<int>(i % 8) + 0.5, y0 + static_cast<int>(i / 8) + 0.5);
    const Eigen::Vector3f d = (world_from_cam.rotation * view.camera.unproject(pixel).value()).cast<float>();
    rays.dx[i] = d.x();
    rays.dy[i] = d.y();
    rays.dz[i] = d.z();
  }
  trace(proxy,
        {world_from_cam.translation.cast<float>(), rays.dx, rays.dy, rays.dz, rays.depth, rays.nx, rays.ny, rays.nz});
  for (const float depth : rays.depth)
    if (!std::isfinite(depth)) return std::nullopt;
  return rays;
}

TEST(ViewBounds, NoRayUndercutsThem) {
  const Proxy ball = MeshProxy(test::bumpy_ball_on_floor(48));
  CameraModel camera = test::pinhole(160, 50);
  const View wanted{test::pinhole(256, 45), test::looking({0.7, -1.9, 2.6}, {0, 0, -0.2})};
  const Eigen::Matrix3f axes = wanted.cam_from_world.rotation.conjugate().toRotationMatrix().cast<float>();
  const Eigen::Vector3d eye = wanted.cam_from_world.inverse().translation;
  const PenaltyOptions options{4, 1, 0.2F, 0.5F};
  const auto focal2 = static_cast<float>(wanted.camera.fx() * wanted.camera.fy());
  std::mt19937 random(5);
  std::uniform_int_distribution<int> at(0, 247);
  int told_hidden = 0;
  for (const double k1 : {0.0, -0.12}) {
    camera.parameters[4] = k1;
    for (const View& photo : test::cap_of_views(40, 4, 60, camera)) {
      const SourceSight sight = make_sight(camera, photo.cam_from_world, {}, ball, {tolerance, 8});
      const AnsweringView view = answering_view(answering_camera(camera), photo.cam_from_world, sight, eye, 0.03F);
      ViewTable table;
      table.add(0, view);
      for (int trial = 0; trial < 60; ++trial) {
        const auto rays = bundle_at(wanted, ball, at(random), at(random));
        if (!rays) continue;
        const RayBundle bundle = rays->bundle(0, largest_bundle, {focal2, 0});
        const RaysBox box = box_of(bundle, axes);
        float least = 0;
        least_penalties(table, box, options, {&least, 1});
        const float largest = largest_weight(view, corners_of(box, axes), tolerance);
        std::array<std::array<float, largest_bundle>, 5> rows;
        std::array<float, largest_bundle> worst;
        worst.fill(std::numeric_limits<float>::infinity());
        answer(view, bundle, options, tolerance, worst, {rows[0], rows[1], rows[2], rows[3], rows[4]});
        for (std::size_t i = 0; i < largest_bundle; ++i) {
          ASSERT_LE(rows[3][i], largest * 1.0001F + 1e-6F);
          ASSERT_GE(rows[4][i] * std::sqrt(std::max(rows[3][i], 1e-20F)) * 1.0001F + 1e-6F,
                    rows[3][i] > 0 ? least : 0.0F);
        }
        if (largest < 0.01F) ++told_hidden;
      }
    }
  }
  EXPECT_GT(told_hidden, 50);  // the bound does tell photos that hide the points
}

}  // namespace
}  // namespace mf
