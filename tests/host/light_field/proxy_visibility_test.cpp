// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/proxy_visibility.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "host/light_field/tile_resampler.h"
#include "host/tracing/ray_scene.h"
#include "tests/host/light_field/synthetic_views.h"

namespace mf {
namespace {

const PlaneRectangle square{{}, {-0.2, -0.2}, {0.2, 0.2}};

// A papered ceiling 1.6 m above, and dark slats half as high, 14 cm wide, every 40 cm.
constexpr float ceiling_m = 1.6F, slats_m = 0.8F, slat_width_m = 0.14F, slat_pitch_m = 0.4F;

bool meets_slat(const Eigen::Vector3f& o, const Eigen::Vector3f& d) {
  const float x = o.x() + (slats_m - o.z()) / d.z() * d.x();
  return std::abs(x - slat_pitch_m * std::round(x / slat_pitch_m)) < 0.5F * slat_width_m;
}

Eigen::Vector3f slatted_light(const Eigen::Vector3f& o, const Eigen::Vector3f& d) {
  if (d.z() < 0.05F) return {0.5F, 0.5F, 0.5F};
  if (meets_slat(o, d)) return {0.1F, 0.2F, 0.1F};
  const Eigen::Vector3f x = o + (ceiling_m - o.z()) / d.z() * d;
  return {2 + std::sin(5 * x.x()), 2 + std::sin(4 * x.y()), 1};
}

void add_sheet(TriangleMesh& mesh, float x0, float x1, float z) {
  constexpr float far_m = 30;
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const auto& [x, y] : {std::pair{x0, -far_m}, {x1, -far_m}, {x1, far_m}, {x0, far_m}})
    mesh.positions.emplace_back(x, y, z);
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

Surroundings slatted_room() {
  TriangleMesh mesh;
  add_sheet(mesh, -30, 30, ceiling_m);
  for (int i = -40; i <= 40; ++i) {
    const float x = slat_pitch_m * static_cast<float>(i);
    add_sheet(mesh, x - 0.5F * slat_width_m, x + 0.5F * slat_width_m, slats_m);
  }
  return mesh_surroundings({0, 0, 0}, std::make_shared<const RayScene>(mesh), "slats.obj");
}

// As long as it hides nothing, black: only where views look matters here.
FieldView view_from(const Eigen::Vector3f& centre, const Eigen::Vector3f& at) {
  return testing::analytic_view(centre, at, 96, [](const auto&, const auto&) { return Eigen::Vector3f::Zero(); });
}

TEST(ProxyVisibility, AMeshHidesWhatLiesBehindIt) {
  const ProxyPoint between(0.2F, 0, ceiling_m, 1);  // above two slats' gap
  const std::vector<FieldView> views{view_from({0.2F, 0, -0.8F}, {0.2F, 0, 0}),
                                     view_from({0.3F, 0, -0.8F}, {0.3F, 0, 0}),
                                     view_from({-0.4F, 0, -0.8F}, {-0.2F, 0, 0})};  // passes the slat above the origin
  const ProxyVisibility visibility(views, slatted_room(), square);
  EXPECT_TRUE(visibility.hides_itself());
  EXPECT_FLOAT_EQ(visibility.of_view(0, between), 1);
  EXPECT_FLOAT_EQ(visibility.of_view(1, between), 1);
  EXPECT_FLOAT_EQ(visibility.of_view(2, between), 0);
  EXPECT_FLOAT_EQ(visibility.of_view(2, {0, 0, slats_m, 1}), 1);  // the slat itself
}

// From inside of a sphere or a box everything is seen.
TEST(ProxyVisibility, ConvexRoomsHideNothing) {
  RoomBox box;
  box.ceiling = 2;
  const std::vector<FieldView> views{view_from({0.1F, 0, -0.8F}, {0, 0, 0})};
  for (const Surroundings& s :
       {box_surroundings({0, 0, 0}, box), sphere_surroundings({0, 0, 0}, 1.5), Surroundings{}}) {
    const ProxyVisibility visibility(views, s, square);
    EXPECT_FALSE(visibility.hides_itself());
    EXPECT_FLOAT_EQ(visibility.of_view(0, {0, 0, 4, 1}), 1);
  }
}

// A ball of a room with a pillar in it, as `auto` finds them: a distance a direction.
Surroundings room_with_pillar() {
  Surroundings s = sphere_surroundings({0, 0, 0}, 3);
  s.inverse_distance = ImageF(96, 96, 1, 1 / 3.0F);
  for (int y = 0; y < 96; ++y)
    for (int x = 0; x < 96; ++x) {
      const Eigen::Vector3f d =
          equal_area_direction(Eigen::Vector2f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F) / 96);
      if (d.dot(Eigen::Vector3f(0.6F, 0, 0.8F)) > 0.95F) s.inverse_distance.at(x, y) = 1;
    }
  return s;
}

// Against a ray of its own for each question.
TEST(ProxyVisibility, MapsOfViewsAnswerLikeRays) {
  const Surroundings s = room_with_pillar();
  std::mt19937 random(7);
  std::uniform_real_distribution<float> even(-1, 1);
  std::vector<FieldView> views;
  for (int i = 0; i < 40; ++i)
    views.push_back(view_from({0.9F * even(random), 0.5F * even(random), -0.6F}, {0.15F * even(random), 0, 0}));
  const ProxyVisibility visibility(views, s, square);
  int asked = 0, hidden = 0, right = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto v = static_cast<std::size_t>(i % 40);
    const Eigen::Vector3f p(0.2F * even(random), 0.2F * even(random), 0);
    const Eigen::Vector3f d = Eigen::Vector3f(even(random), even(random), 0.8F).normalized();
    const ProxyPoint x = proxy_point(p, d, s.inverse_distance_along(p, d));
    const Eigen::Vector3f pixel = pixel_of(views[v], x), ray = ray_to(x, views[v].centre_in_world);
    const Eigen::Vector3f crossing = views[v].centre_in_world + 0.6F / ray.z() * ray;
    const bool seen = pixel.z() > 0 && (pixel.head<2>() / pixel.z()).minCoeff() > 0 &&
                      (pixel.head<2>() / pixel.z()).maxCoeff() < 96 && crossing.head<2>().cwiseAbs().maxCoeff() < 0.25F;
    if (!seen) continue;
    const float met = s.inverse_distance_along(crossing, ray.normalized());
    const float expected = x.w() / (x.head<3>() - x.w() * crossing).norm();
    const bool is_hidden = met > expected + 1.5F * (0.1F + 0.1F * expected);
    ++asked;
    hidden += is_hidden ? 1 : 0;
    right += (visibility.of_view(v, x) < 0.5F) == is_hidden ? 1 : 0;
  }
  EXPECT_GT(asked, 1000);
  EXPECT_GT(hidden, asked / 100);
  EXPECT_GT(right, 0.97 * asked);
}

// RMS of tiles against the light itself, relative, where cells show the ceiling alone: slats' edges are as soft as a
// cell.
double error_between_slats(const std::vector<FieldView>& views, const LightField& field,
                           const ProxyVisibility& visibility) {
  const EmitterBlender no_emitters(views, field.surroundings, {}, EmitterBlender::Lit::no);
  TileResampler resampler(views, field, visibility, no_emitters, {6, 1, 0, 1});
  const TexelGrid grid(field.plane, field.resolution);
  std::vector<Eigen::Vector4f> tile(field.texel_count());
  double error = 0;
  int rays = 0;
  for (std::size_t i = 0; i < field.directions.size(); i += 31) {
    const Eigen::Vector3f& d = field.directions.directions[i];
    if (d.z() < 0.5F) continue;
    resampler.fill(i, tile.data());
    const std::vector<CellSample> parts = split_cell(field.directions, i, 2);
    for (int y = 0; y < field.resolution; y += 2)
      for (int x = 0; x < field.resolution; x += 2) {
        const Eigen::Vector3f p = grid.at(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
        const Eigen::Vector4f& seen = tile[static_cast<std::size_t>(y * field.resolution + x)];
        if (seen.w() < 0.5F || std::any_of(parts.begin(), parts.end(),
                                           [&](const CellSample& part) { return meets_slat(p, part.direction); }))
          continue;
        const Eigen::Vector3f truth = slatted_light(p, d);
        error += (seen.head<3>() - truth).squaredNorm() / truth.squaredNorm();
        ++rays;
      }
  }
  EXPECT_GT(rays, 3000);
  return std::sqrt(error / rays);
}

// Views whose rays meet a slat on their way do not darken what the plane sees between the slats.
TEST(ProxyVisibility, TilesDoNotShowWhatHidesARayFromOtherViews) {
  const std::vector<FieldView> views = testing::analytic_views(160, 0.3F, 96, slatted_light);
  LightField field;
  field.plane = square;
  field.resolution = 24;
  field.directions = geodesic_hemisphere(6000);
  field.surroundings = slatted_room();
  const Surroundings hides_nothing = sphere_surroundings({0, 0, 0}, ceiling_m);
  const double blind = error_between_slats(views, field, ProxyVisibility(views, hides_nothing, square));
  const double error = error_between_slats(views, field, ProxyVisibility(views, field.surroundings, square));
  EXPECT_LT(error, 0.09);
  EXPECT_LT(error, 0.5 * blind);
}

}  // namespace
}  // namespace mf
