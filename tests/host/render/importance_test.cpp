// SPDX-License-Identifier: Apache-2.0
#include "host/render/importance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "host/render/incident_light.h"
#include "host/render/irradiance.h"
#include "host/tracing/ray_scene.h"
#include "tests/host/render/scenes.h"

namespace mf {
namespace {

using test::pi;

const Eigen::Vector3f lamp = Eigen::Vector3f(0.4F, 0.3F, 1).normalized();

LightField lamp_and_sky() {
  return test::distant_field(2500, [](const Eigen::Vector3f& d) -> Eigen::Vector3f {
    return Eigen::Vector3f::Constant(d.dot(lamp) > std::cos(0.06F) ? 400.F : 1 + d.x());
  });
}

std::vector<CellGroup> groups_of(const LightField& field, int count) {
  return group_cells(field.directions, light_of_tiles(field.directions, images_of(field)), count);
}

TEST(Importance, EveryCellIsInOneGroup) {
  const LightField field = lamp_and_sky();
  const int cells = static_cast<int>(field.directions.size());
  for (const int count : {1, 2, 37, 200, cells - 1, cells, 100000}) {
    const auto groups = groups_of(field, count);
    EXPECT_EQ(groups.size(), static_cast<std::size_t>(std::min(count, cells)));
    std::vector<int> seen(field.directions.size(), 0);
    for (const CellGroup& group : groups)
      for (const std::uint32_t cell : group.cells) ++seen[cell];
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), cells) << count;
  }
}

TEST(Importance, AllLightIsKeptWhateverTheNumber) {
  const LightField field = lamp_and_sky();
  const std::vector<double> light = light_of_tiles(field.directions, images_of(field));
  Eigen::Vector3d whole = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < light.size(); ++i) whole += light[i] * field.directions.directions[i].cast<double>();
  for (const int count : {1, 5, 60, 200, 1000}) {
    Eigen::Vector3d kept = Eigen::Vector3d::Zero();
    for (const CellGroup& group : group_cells(field.directions, light, count)) {
      double solid_angle = 0;
      for (const std::uint32_t cell : group.cells)
        solid_angle += static_cast<double>(field.directions.solid_angles_sr[cell]);
      kept += group.light / solid_angle * static_cast<double>(group.solid_angle_sr) * group.direction.cast<double>();
    }
    EXPECT_LT((kept - whole).norm(), 1e-3 * whole.norm()) << count;
  }
}

TEST(Importance, TheLampIsTakenApartAndTheDimIsNot) {
  const LightField field = lamp_and_sky();
  double of_lamp = 0, widest = 0;
  for (const CellGroup& group : groups_of(field, 200)) {
    const bool bright = group.direction.dot(lamp) > std::cos(0.06F);
    if (bright) {
      EXPECT_EQ(group.cells.size(), 1U);
    }
    of_lamp += bright ? 1 : 0;
    widest = std::max(widest, static_cast<double>(group.cells.size()));
  }
  EXPECT_GE(of_lamp, 4);
  EXPECT_GT(widest, 20);
}

TEST(IncidentLight, OfAnEvenSkyIsPiForAnyNumberOfDirections) {
  const LightField field = test::constant_field(2500, 2);
  for (const int directions : {0, 1, 10, 200, 1500}) {
    LightOptions options;
    options.directions = directions;
    const IncidentLight light = incident_light(field, {}, options);
    EXPECT_NEAR(light.bare.texels[5].y(), 2 * pi, 2 * pi * 2e-3) << directions;
    EXPECT_LE(light.for_bounce.lights.size(), 320U);
  }
}

// A surface sees half of the lights at most: few must still light it as all do.
TEST(IncidentLight, OfFewDirectionsLightsSurfacesAsAllDo) {
  const LightField field = lamp_and_sky();
  const RayScene nothing(TriangleMesh{});
  const std::vector<SurfacePoint> points{test::facing({0, 0, 0.1F}, {0, 0, 1}), test::facing({0, 0, 0.1F}, {1, 0, 0}),
                                         test::facing({0, 0, 0.1F}, {0, -1, 0}),
                                         test::facing({0, 0, 0.1F}, Eigen::Vector3f(-1, -1, 0.3F).normalized())};
  const auto sums = [&](int directions) {
    LightOptions options;
    options.directions = directions;
    return irradiance_cpu(nothing, points, incident_light(field, {}, options).from_above, LightSum::visible);
  };
  const auto all = sums(0), few = sums(200);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(few[i].x() / all[i].x(), 1, 0.02) << i;
}

// Of light that comes in tiles of different places and sizes, as a preview's do.
TEST(IncidentLight, TheBarePlaneSumsWhatEachTileHolds) {
  std::vector<PlaneTile> tiles;
  for (int i = 0; i < 12; ++i) {
    const auto shift = 0.02F * static_cast<float>(i);
    PlaneTile tile{{-0.3F + shift, -0.2F}, {0.1F + shift, 0.3F - shift}, 16, i % 2 == 0 ? 16 : 24, {}};
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x) {
        const Eigen::Vector2f p = tile.position(x, y);
        tile.texels.emplace_back(1 + p.x(), 1 + std::sin(6 * p.y()), 2, 0);
      }
    tiles.push_back(std::move(tile));
  }
  const DirectionSet set = geodesic_hemisphere(100);
  const std::vector<CellGroup> groups = group_cells(set, std::vector<double>(set.size(), 1), 12);
  std::vector<PlaneImage> images;
  for (const PlaneTile& tile : tiles) images.push_back(tile.image());
  const PlaneTile bare = bare_irradiance(make_light_set(set, groups, images, {0, 1}));
  for (const float x : {-0.35F, -0.25F, 0.F, 0.12F, 0.4F})
    for (const float y : {-0.25F, -0.1F, 0.04F, 0.2F, 0.35F}) {
      Eigen::Vector3f expected = Eigen::Vector3f::Zero();
      for (std::size_t i = 0; i < groups.size(); ++i)
        expected += groups[i].direction.z() * groups[i].solid_angle_sr * sample(images[i], {x, y}).head<3>();
      const Eigen::Vector3f sum = sample(bare.image(), {x, y}).head<3>();
      EXPECT_LT((sum - expected).norm(), 0.003F * expected.norm()) << x << ' ' << y;
    }
}

// A composite's preview needs the plane beneath the object and where its shadows fall.
TEST(IncidentLight, APreviewAsksForThePlaneNearTheObject) {
  using Plane = LightOptions::Plane;
  const LightField field = lamp_and_sky();
  const std::vector<double> light = light_of_tiles(field.directions, images_of(field));
  const Bounds box{{0.1F, 0, 0.05F}, {0.2F, 0.1F, 0.25F}, {0.15F, 0.05F, 0.15F}, 0.13F};
  for (const auto& [directions, plane] :
       {std::pair(0, Plane::near_object), std::pair(200, Plane::near_object), std::pair(200, Plane::all)}) {
    LightOptions options;
    options.directions = directions;
    options.plane = plane;
    const LightPlan plan = plan_light(field.directions, light, box, field.plane, options);
    for (std::size_t i = 0; i < plan.groups.size(); ++i) {
      const TileRequest& request = plan.requests[i];
      const Eigen::Vector3f& w = plan.groups[i].direction;
      const Eigen::Vector2f shadow = box.high.head<2>() - w.head<2>() * (box.high.z() / w.z());
      for (const Eigen::Vector2f& p : {Eigen::Vector2f(0.1F, 0), Eigen::Vector2f(0.2F, 0.1F), shadow}) {
        if ((p.array().abs() > 0.5F).any()) continue;  // beyond the rectangle
        EXPECT_TRUE((p.array() >= request.min_m.array() - 1e-5F).all()) << i;
        EXPECT_TRUE((p.array() <= request.max_m.array() + 1e-5F).all()) << i;
      }
      const bool whole = (request.min_m.array() <= -0.5F).all() && (request.max_m.array() >= 0.5F).all();
      EXPECT_EQ(whole, directions == 0 || plane == Plane::all) << i;
    }
  }
}

// One light may come from far off the object: what lines through its box along the light meet, is asked for.
TEST(Importance, TilesHoldWhatTheObjectLooksUp) {
  const DirectionSet set = geodesic_hemisphere(100);
  const Bounds box{{0.1F, 0, 0.05F}, {0.2F, 0.1F, 0.25F}, {0.15F, 0.05F, 0.15F}, 0.13F};
  const std::vector<CellGroup> groups = group_cells(set, std::vector<double>(set.size(), 1), 40);
  const std::vector<TileRequest> requests = tiles_for_object(set, groups, box);
  ASSERT_EQ(requests.size(), groups.size());
  for (std::size_t i = 0; i < groups.size(); ++i) {
    EXPECT_EQ(requests[i].cells, groups[i].cells);
    const Eigen::Vector3f& w = groups[i].direction;
    for (const Eigen::Vector3f& x : {box.low, box.high, box.centre}) {
      const Eigen::Vector2f p = x.head<2>() - w.head<2>() * (x.z() / w.z());
      EXPECT_TRUE((p.array() >= requests[i].min_m.array() - 1e-5F).all()) << i;
      EXPECT_TRUE((p.array() <= requests[i].max_m.array() + 1e-5F).all()) << i;
    }
  }
}

}  // namespace
}  // namespace mf
