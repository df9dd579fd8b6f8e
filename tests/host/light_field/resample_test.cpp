// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/resample.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/light_field/emitters.h"
#include "host/light_field/probe.h"
#include "host/light_field/view_rays.h"
#include "tests/host/light_field/synthetic_views.h"

namespace mf {
namespace {

const PlaneRectangle square{{}, {-0.2, -0.2}, {0.2, 0.2}};

// A smooth distant sky: colours follow the direction.
Eigen::Vector3f sky(const Eigen::Vector3f&, const Eigen::Vector3f& d) {
  return {1 + 0.5F * d.x(), 1 + 0.5F * d.y(), 0.5F + d.z() * d.z()};
}

// A globe of radiance 100 before a dim distant sky.
struct Globe {
  Eigen::Vector3f centre{0.3F, 0.2F, 0.9F};
  float radius = 0.05F;
  Eigen::Vector3f operator()(const Eigen::Vector3f& o, const Eigen::Vector3f& d) const {
    const Eigen::Vector3f to = centre - o;
    const float along = to.dot(d);
    const bool hit = along > 0 && to.squaredNorm() - along * along < radius * radius;
    return hit ? Eigen::Vector3f::Constant(100) : Eigen::Vector3f::Constant(0.1F);
  }
  // Irradiance of a small globe on the plane at p, without the sky: L · solid angle · cosine.
  [[nodiscard]] double irradiance(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d to = centre.cast<double>() - p;
    const double sine = static_cast<double>(radius) / to.norm();
    return 100 * M_PI * sine * sine * to.z() / to.norm();
  }
};

double irradiance_at(const LightField& field, const Eigen::Vector2f& p) {
  double sum = 0;
  for (std::size_t i = 0; i < field.directions.size(); ++i)
    sum += static_cast<double>(sample_tile(field, i, p).x() * field.directions.directions[i].z() *
                               field.directions.solid_angles_sr[i]);
  return sum;
}

TEST(Resample, DistantSkyComesBack) {
  const auto views = testing::analytic_views(150, 0.25F, 64, sky);
  ResampleOptions options;
  options.directions = 300;
  options.size = 8;
  options.proxy = "sphere:inf";
  const ResampleResult r = resample(views, square, options, {});
  int seen = 0;
  for (std::size_t i = 0; i < r.field.directions.size(); ++i) {
    const Eigen::Vector4f texel = r.field.tile(i)[8 * 3 + 5];
    if (texel.w() < 0.9F || r.field.directions.directions[i].z() < 0.2F) continue;
    ++seen;
    const Eigen::Vector3f expected = sky({}, r.field.directions.directions[i]);
    EXPECT_LT((texel.head<3>() - expected).norm(), 0.03F * expected.norm()) << i;
  }
  EXPECT_GT(seen, 200);
}

// A lamp smaller than the directions' spacing keeps its energy, whatever their number.
TEST(Resample, SmallLampKeepsItsEnergy) {
  const Globe globe;
  const auto views = testing::analytic_views(400, 0.25F, 96, globe);
  const double distance = static_cast<double>(globe.centre.norm());
  for (const int directions : {150, 500, 1500}) {
    ResampleOptions options;
    options.directions = directions;
    options.size = 8;
    options.proxy = "sphere:" + std::to_string(distance);
    const ResampleResult r = resample(views, square, options, {});
    const double sky_part = 0.1 * M_PI;
    double ours = 0, truth = 0;
    for (const float x : {-0.12F, 0.0F, 0.12F})
      for (const float y : {-0.12F, 0.0F, 0.12F}) {
        ours += irradiance_at(r.field, {x, y}) - sky_part;
        truth += globe.irradiance({x, y, 0});
      }
    EXPECT_NEAR(ours / truth, 1, 0.06) << directions;
  }
}

// The same at the counts that people use, with the proxy that they use: what a point receives does not depend on them.
TEST(Resample, IrradianceDoesNotDependOnTheNumberOfDirections) {
  const auto views = testing::analytic_views(400, 0.25F, 96, Globe{});
  std::vector<double> received;
  for (const int directions : {500, 2500, 9000}) {
    ResampleOptions options;
    options.directions = directions;
    options.size = 8;
    const ResampleResult r = resample(views, square, options, {});
    double sum = 0;
    for (const float x : {-0.12F, 0.0F, 0.12F})
      for (const float y : {-0.12F, 0.0F, 0.12F}) sum += irradiance_at(r.field, {x, y});
    received.push_back(sum);
  }
  EXPECT_NEAR(received[0] / received[1], 1, 0.02);
  EXPECT_NEAR(received[2] / received[1], 1, 0.02);
}

// A lamp before far surroundings: focused on these, views that pass a ray by some centimetres show the lamp beside
// where it is. No texel shows that, whatever few views there are.
TEST(Resample, NoTexelShowsALampThatItsRaysMiss) {
  const Globe globe;
  const auto views = testing::analytic_views(120, 0.25F, 96, globe);
  ResampleOptions options;
  options.directions = 1000;
  options.size = 64;
  options.proxy = "sphere:4";
  const LightField field = resample(views, square, options, {}).field;
  ASSERT_EQ(field.emitters.size(), 1U);
  int beside = 0, lit = 0;
  for (std::size_t i = 0; i < field.directions.size(); ++i)
    for (int t = 0; t < 64 * 64; ++t) {
      const float x = -0.2F + 0.00625F * (static_cast<float>(t % 64) + 0.5F);
      const float y = 0.2F - 0.00625F * (static_cast<float>(t / 64) + 0.5F);
      const Eigen::Vector3f to = globe.centre - Eigen::Vector3f(x, y, 0), d = field.directions.directions[i];
      const float cell = std::sqrt(field.directions.solid_angles_sr[i]);
      const bool misses = to.dot(d) < 0 || to.cross(d).norm() > 2 * globe.radius + cell * to.norm();
      const Eigen::Vector4f texel = field.tile(i)[t];
      if (!misses || texel.w() < 0.1F) continue;
      ++beside;
      lit += texel.x() > 0.15F ? 1 : 0;
    }
  EXPECT_GT(beside, 1000000);
  EXPECT_EQ(lit, 0) << "of " << beside;
}

// Leaves hide a third and more of the lamp in most views, and half of them always on one side.
TEST(Emitters, ALampBehindLeavesIsFoundWhole) {
  const Globe globe;
  const auto leaf = [](const Eigen::Vector3f& o, const Eigen::Vector3f& d) {  // striped, halfway to the lamp
    constexpr float height = 0.45F;
    const Eigen::Vector3f at = o + (height - o.z()) / d.z() * d;
    const bool hides = std::sin(70 * at.x()) + std::sin(45 * at.y() + 1) > 0.3F;
    return o.z() < height && d.z() > 0 && hides;
  };
  const auto views = testing::analytic_views(200, 0.25F, 128, [&](const auto& o, const auto& d) -> Eigen::Vector3f {
    return leaf(o, d) ? Eigen::Vector3f::Constant(0.02F) : globe(o, d);
  });
  const std::vector<Emitter> found = find_emitters(views);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_LT((found[0].position - globe.centre).norm(), 0.012F);
  EXPECT_NEAR(found[0].radius_m, globe.radius, 0.06F * globe.radius);
}

TEST(Resample, PhotoConsistencyFindsTheDistance) {
  // A textured sphere of 1.4 m about the origin.
  const testing::Light wall = [](const Eigen::Vector3f& o, const Eigen::Vector3f& d) -> Eigen::Vector3f {
    const float b = o.dot(d), t = -b + std::sqrt(b * b - o.squaredNorm() + 1.4F * 1.4F);
    const Eigen::Vector3f x = o + t * d;
    return Eigen::Vector3f::Constant(1.2F + std::sin(9 * x.x()) * std::cos(8 * x.y()));
  };
  const auto views = testing::analytic_views(200, 0.25F, 64, wall);
  const auto scores = score_spheres(views, square, 6);
  const auto best = std::min_element(scores.begin(), scores.end(), [](const SphereScore& a, const SphereScore& b) {
    return a.inconsistency < b.inconsistency;
  });
  EXPECT_DOUBLE_EQ(best->radius_m, 1.4);
  const Surroundings found = find_surroundings(sweep_surroundings(views, square), {});
  std::vector<float> distances;
  for (const Eigen::Vector3f& d : geodesic_hemisphere(300).directions)
    if (d.z() > 0.3F) distances.push_back(1 / found.inverse_distance_of(d));
  std::sort(distances.begin(), distances.end());
  EXPECT_NEAR(distances[distances.size() / 2], 1.4, 0.1);
  EXPECT_GT(distances[distances.size() / 10], 1.1);
  EXPECT_LT(distances[distances.size() * 9 / 10], 1.8);
}

TEST(Resample, NobodyLookedMeansNoConfidence) {
  std::vector<FieldView> views{testing::analytic_view({0, 0, -0.8F}, {0, 0, 0}, 64, sky)};  // straight up only
  ResampleOptions options;
  options.directions = 100;
  options.size = 4;
  options.proxy = "sphere:inf";
  options.fill = false;
  const ResampleResult r = resample(views, square, options, {});
  for (std::size_t i = 0; i < r.field.directions.size(); ++i) {
    const bool overhead = r.field.directions.directions[i].z() > 0.97F;
    if (overhead) {
      EXPECT_GT(r.field.tile(i)[5].w(), 0.5F);
    }
    if (r.field.directions.directions[i].z() < 0.7F) {
      EXPECT_EQ(r.field.tile(i)[5], Eigen::Vector4f::Zero());
    }
  }
}

TEST(Probe, LooksAlongTheRightDirections) {
  const auto views = testing::analytic_views(300, 0.25F, 64, sky);
  ResampleOptions options;
  options.directions = 600;
  options.size = 8;
  options.proxy = "sphere:inf";
  const ResampleResult r = resample(views, square, options, {});
  for (const auto convention : {LatLongConvention::blender, LatLongConvention::openexr, LatLongConvention::threejs}) {
    const Probe probe = make_probe(r.field, {0, 0, 0.1}, convention, 64);
    for (int y = 0; y < 14; ++y)  // well above the horizon
      for (int x = 0; x < 64; ++x) {
        const Eigen::Vector3f d = lat_long_direction(convention, 64, 32, x, y).cast<float>();
        const Eigen::Vector3f expected = sky({}, d);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(probe.radiance.at(x, y, c), expected[c], 0.08F);
      }
  }
}

// The table of facts: what is at the centre, a quarter to the left, and at the top (in the consumer's axes).
TEST(Probe, ConventionsOfConsumers) {
  const auto near = [](const Eigen::Vector3d& d, double x, double y, double z) {
    return (d - Eigen::Vector3d(x, y, z)).norm() < 0.02;
  };
  constexpr int w = 1000, h = 500;
  const auto blender = [&](int x, int y) { return lat_long_direction(LatLongConvention::blender, w, h, x, y); };
  EXPECT_TRUE(near(blender(500, 250), 0, 1, 0) && near(blender(250, 250), -1, 0, 0) && near(blender(500, 0), 0, 0, 1));
  // World (x, y, z) is (x, z, −y) in Y-up axes: OpenEXR's +Z at the centre is the world's −y, three.js' +X its +x.
  const auto openexr = [&](int x, int y) { return lat_long_direction(LatLongConvention::openexr, w, h, x, y); };
  EXPECT_TRUE(near(openexr(500, 250), 0, -1, 0) && near(openexr(250, 250), 1, 0, 0) && near(openexr(500, 0), 0, 0, 1));
  const auto threejs = [&](int x, int y) { return lat_long_direction(LatLongConvention::threejs, w, h, x, y); };
  EXPECT_TRUE(near(threejs(500, 250), 1, 0, 0) && near(threejs(250, 250), 0, 1, 0) && near(threejs(500, 0), 0, 0, 1));
}

TEST(Surroundings, ParsesNames) {
  EXPECT_EQ(parse_sphere("sphere:2.5"), 2.5);
  EXPECT_TRUE(std::isinf(parse_sphere("sphere:inf").value()));
  for (const char* bad : {"sphere", "sphere:", "sphere:-1", "sphere:0", "sphere:1x", "box", ""})
    EXPECT_FALSE(parse_sphere(bad)) << bad;
}

TEST(Surroundings, EqualAreaMapInverts) {
  for (const Eigen::Vector3f& d : geodesic_hemisphere(200).directions)
    EXPECT_LT((equal_area_direction(equal_area_square(d)) - d).norm(), 1e-4F);
}

TEST(Surroundings, RaysMeetTheSphere) {
  const Surroundings sphere = sphere_surroundings({0.1F, 0, 0}, 2);
  const Eigen::Vector3f p(0.3F, -0.2F, 0), d = Eigen::Vector3f(0.5F, 0.2F, 0.8F).normalized();
  const Eigen::Vector3f x = p + d / sphere.inverse_distance_along(p, d);
  EXPECT_NEAR((x - Eigen::Vector3f(0.1F, 0, 0)).norm(), 2, 1e-4);
  EXPECT_EQ(sphere_surroundings({0, 0, 0}, std::numeric_limits<double>::infinity()).inverse_distance_along(p, d), 0);
}

}  // namespace
}  // namespace mf
