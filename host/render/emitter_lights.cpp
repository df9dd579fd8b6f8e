// SPDX-License-Identifier: Apache-2.0
#include "host/render/emitter_lights.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>

#include "common/check.h"

namespace mf {

namespace {

constexpr float golden_angle = 2.3999632F;  // π (3 − √5)

// Evenly over the disc (Vogel 1979), at right angles to the line from x.
std::vector<Eigen::Vector3f> points_on_disc(const Eigen::Vector3f& centre, float radius, const Eigen::Vector3f& x,
                                            int count) {
  const Eigen::Vector3f to = (centre - x).normalized(), across = to.unitOrthogonal(), up = to.cross(across);
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < count; ++k) {
    const float r = radius * std::sqrt((static_cast<float>(k) + 0.5F) / static_cast<float>(count));
    const float angle = static_cast<float>(k) * golden_angle;
    points.emplace_back(centre + r * (std::cos(angle) * across + std::sin(angle) * up));
  }
  return points;
}

struct Rectangle {
  Eigen::Vector2f low, high;
};

// Of the mask, plane frame.
Rectangle mask_rectangle(const ShadedEmitter& e, const Rigid3& plane_from_world) {
  const auto in_plane = [&](const Eigen::Vector2f& m) -> Eigen::Vector2f {
    return (plane_from_world * Eigen::Vector3d(static_cast<double>(m.x()), static_cast<double>(m.y()),
                                               static_cast<double>(e.plane_height_m)))
        .head<2>()
        .cast<float>();
  };
  const Eigen::Vector2f a = in_plane(e.mask_min_m), b = in_plane(e.mask_max_m);
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

// Where lines from the box to the emitter cross the plane, kept within `all`.
Rectangle seen_through(const Bounds& box, const Eigen::Vector3f& centre, float radius, const Rectangle& all) {
  Rectangle part{all.high, all.low};
  for (const Eigen::Vector3f& x : corners_of(box)) {
    if (x.z() >= centre.z() - radius) return all;  // level with the emitter: anywhere
    const float beyond = std::max(0.F, x.z()) / (centre.z() - radius - x.z());
    const Eigen::Vector2f p = x.head<2>() + beyond * (x - centre).head<2>();
    const Eigen::Vector2f reach = Eigen::Vector2f::Constant(beyond * radius);
    part.low = part.low.cwiseMin(p - reach);
    part.high = part.high.cwiseMax(p + reach);
  }
  part.low = part.low.cwiseMax(all.low).cwiseMin(all.high);
  part.high = part.high.cwiseMax(all.low).cwiseMin(all.high);
  return (part.high.array() > part.low.array()).all() ? part : all;
}

// A black tile with texels as fine as the mask's.
PlaneTile empty_tile(const Rectangle& where, const Eigen::Vector2f& mask_texel_m) {
  const Eigen::Array2f texels = ((where.high - where.low).array() / mask_texel_m.array()).ceil().max(2.F);
  return black_tile(where.low, where.high, static_cast<int>(texels.x()), static_cast<int>(texels.y()));
}

// The middles of a tile's texels, in the world.
std::vector<Eigen::Vector3f> texels_in_world(const PlaneTile& tile, const Rigid3& world_from_plane) {
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(tile.texels.size());
  for (int y = 0; y < tile.height; ++y)
    for (int x = 0; x < tile.width; ++x) {
      const Eigen::Vector2f at = tile.position(x, y);
      positions.emplace_back(
          (world_from_plane * Eigen::Vector3d(static_cast<double>(at.x()), static_cast<double>(at.y()), 0))
              .cast<float>());
    }
  return positions;
}

// What the emitter's point shows of itself to the plane: its radiance through the mask; black without a mask.
void see_on_plane(const ShadedEmitter& e, const Eigen::Vector3f& point_in_world,
                  std::span<const Eigen::Vector3f> texels_in_world, PlaneTile& tile) {
  for (std::size_t i = 0; i < tile.texels.size(); ++i) {
    const Eigen::Vector3f& p = texels_in_world[i];
    tile.texels[i].head<3>() = e.visibility(p, (point_in_world - p).normalized()).value_or(0) * e.radiance;
  }
}

}  // namespace

EmitterLights emitter_lights(const LightField& field, const Bounds& object_in_plane, bool plane, int points) {
  check(points >= 1, "some points on each emitter");
  const Rigid3& world_from_plane = field.plane.world_from_plane;
  const Rigid3 plane_from_world = world_from_plane.inverse();
  EmitterLights lights;
  for (const ShadedEmitter& e : field.emitters) {
    if (e.mask.empty()) continue;
    const Eigen::Vector3f centre = (plane_from_world * e.emitter.position.cast<double>()).cast<float>();
    const Rectangle all = mask_rectangle(e, plane_from_world);
    const Rectangle where = plane ? all : seen_through(object_in_plane, centre, e.emitter.radius_m, all);
    const Eigen::Vector2f texel =
        (all.high - all.low)
            .cwiseQuotient(Eigen::Vector2f(static_cast<float>(e.mask.width), static_cast<float>(e.mask.height)));
    const PlaneTile black = empty_tile(where, texel);
    const std::vector<Eigen::Vector3f> positions = texels_in_world(black, world_from_plane);
    const std::size_t first = lights.tiles.size();
    for (const Eigen::Vector3f& p : points_on_disc(centre, e.emitter.radius_m, object_in_plane.centre, points)) {
      lights.points.push_back({p, centre, e.emitter.radius_m, 1 / static_cast<float>(points),
                               static_cast<std::uint32_t>(lights.points.size())});
      lights.tiles.emplace_back();
    }
    tbb::parallel_for(first, lights.tiles.size(), [&](std::size_t i) {
      const Eigen::Vector3f in_world = (world_from_plane * lights.points[i].position.cast<double>()).cast<float>();
      lights.tiles[i] = black;
      see_on_plane(e, in_world, positions, lights.tiles[i]);
    });
  }
  return lights;
}

void append_emitters(LightSet& set, const EmitterLights& lights) {
  const auto first = static_cast<std::uint32_t>(set.images.size());
  for (const PlaneTile& tile : lights.tiles) set.images.push_back(tile.image());
  for (EmitterPoint point : lights.points) {
    point.image += first;
    set.emitter_points.push_back(point);
  }
}

}  // namespace mf
