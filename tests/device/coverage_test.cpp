// SPDX-License-Identifier: Apache-2.0
#include "device/coverage.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>
#include <random>

#include "common/error.h"
#include "common/virtual_view.h"
#include "device/guidance.h"
#include "hw-sim/desk_rig.h"
#include "hw-sim/motion.h"
#include "hw-sim/scene.h"
#include "tests/device/waving_hand.h"

namespace mf {
namespace {

using Eigen::Vector3d;

constexpr double degree = std::numbers::pi / 180;

Vector3d random_direction(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double z = unit(random), turn = 2 * std::numbers::pi * unit(random);
  return {std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z};
}

TEST(DirectionGrid, PartsTheHemisphere) {
  const DirectionGrid grid(8 * degree);
  double sum = 0;
  for (int d = 0; d < grid.directions(); ++d) {
    EXPECT_EQ(grid.find(grid.centre(d)), d);
    EXPECT_NEAR(grid.centre(d).norm(), 1, 1e-12);
    sum += grid.projected_solid_angle(d);
  }
  EXPECT_NEAR(sum, std::numbers::pi, 1e-9);
  EXPECT_NEAR(grid.patches(), 2 * std::numbers::pi / std::pow(8 * degree, 2), 20);
  // A direction's share of the hemisphere's cosine-weighted measure, by sampling.
  std::mt19937 random(1);
  std::vector<double> hits(static_cast<std::size_t>(grid.directions()));
  constexpr int samples = 400000;
  for (int i = 0; i < samples; ++i) {
    const Vector3d v = random_direction(random);
    const int d = grid.find(v);
    ASSERT_LT(std::acos(std::min(1.0, v.dot(grid.centre(d)))), 5 * degree);
    hits[static_cast<std::size_t>(d)] += v.z() * 2 * std::numbers::pi / samples;
  }
  for (const int d : {0, 100, 700, grid.directions() - 1})
    EXPECT_NEAR(hits[static_cast<std::size_t>(d)], grid.projected_solid_angle(d),
                0.25 * grid.projected_solid_angle(d) + 1e-5);
}

TEST(RadianceMap, FindsHowFarTheLampIs) {
  const DirectionGrid grid(8 * degree);
  for (const double distance : {1.0, 2.5}) {
    RadianceMap map(grid);
    EXPECT_EQ(map.mean(), 1);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> place(-0.2, 0.2);
    const Vector3d lamp = distance * Vector3d(0.4, 0.5, 0.77).normalized();
    for (int i = 0; i < 20000; ++i) {
      const Vector3d from(place(random), place(random), 0);
      const Vector3d unit = random_direction(random);
      map.add(from, unit, (lamp - from).normalized().dot(unit) > std::cos(4 * degree) ? 100 : 0.1);
    }
    map.settle();
    EXPECT_EQ(map.radius_m(), distance);
    for (const Vector3d& from : {Vector3d(-0.18, 0.1, 0), Vector3d(0.18, -0.1, 0)}) {
      const Vector3d to = (lamp - from).normalized();
      EXPECT_GT(map.radiance(map.place(from, to)), 30);
      EXPECT_LT(map.radiance(map.place(from, Eigen::AngleAxisd(0.25, Vector3d::UnitX()) * to)), 10);
    }
  }
}

// Against the reflection of common/: what a pixel of the opening shows is on the line from the virtual centre.
TEST(MirrorReach, ShowsThePointFromTheDirection) {
  const MirrorReach reach = test::desk_reach();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-0.15, 0.15);
  int shown = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector3d p(place(random), place(random), 0), direction = random_direction(random);
    const std::optional<Rigid3> pose = reach.showing(p, direction, reach.picture_right());
    if (!pose) continue;
    ++shown;
    EXPECT_TRUE(reach.allows(*pose));
    EXPECT_GT(reach.above_plane_m(*pose), 0.01);
    const auto view = mirror_view(reach.cam_from_world() * *pose, sim::desk_mirror(), reach.camera());
    ASSERT_TRUE(view);
    const Vector3d centre = reach.cam_from_world().inverse() * view->centre_in_cam();
    EXPECT_LT((centre - virtual_centre(reach.camera_in_world(), *pose)).norm(), 1e-9);
    EXPECT_GT((p - centre).normalized().dot(direction), 1 - 1e-9);
    const Vector3d seen = view->reflected(reach.cam_from_world() * p);
    ASSERT_GT(seen.z(), 0);
    const Eigen::Vector2d pixel = reach.camera().project(seen);
    Eigen::Vector2d low = view->opening_in_img[0];
    Eigen::Vector2d high = low;
    for (const Eigen::Vector2d& corner : view->opening_in_img) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
    EXPECT_TRUE((pixel - low).minCoeff() > 0 && (high - pixel).minCoeff() > 0);
  }
  EXPECT_GT(shown, 150);
}

class CoverageTest : public testing::Test {
 protected:
  MirrorReach reach_ = test::desk_reach();
  Coverage coverage_{test::desk_coverage(), reach_};

  void show(const Rigid3& world_from_mirror, const test::Surroundings& light) {
    coverage_.add(reach_.cam_from_world() * world_from_mirror, test::mirrored(reach_, world_from_mirror, light, 8), 8);
  }
  [[nodiscard]] Rigid3 showing(const Vector3d& p, const Vector3d& direction) const {
    return *reach_.showing(p, direction.normalized(), reach_.picture_right());
  }
};

TEST_F(CoverageTest, NothingSeenNothingCovered) {
  const CoverageStatus status = coverage_.status();
  EXPECT_EQ(status.covered, 0);
  EXPECT_FALSE(status.done);
  EXPECT_GT(status.patches.size(), 150U);
  double weights = 0;
  for (const CoveragePatch& patch : status.patches) weights += patch.weight;
  EXPECT_NEAR(weights, 1, 1e-5);
}

TEST_F(CoverageTest, AViewCoversItsDirectionAndAResetHandAddsNothing) {
  const Rigid3 pose = showing({0, 0, 0}, {0.1, 0.3, 1});
  const double promised = coverage_.gain({&pose, 1});
  show(pose, test::uniform_light());
  const CoverageStatus status = coverage_.status();
  EXPECT_EQ(coverage_.views(), 1);
  EXPECT_GT(status.covered, 0.005);
  EXPECT_NEAR(status.covered, promised, 0.45 * status.covered);
  const double elevation = std::asin(Vector3d(0.1, 0.3, 1).normalized().z()) / degree;
  for (const CoveragePatch& patch : status.patches) {
    const bool near = std::abs(patch.elevation_deg - elevation) < 4 && std::abs(patch.azimuth_deg - 72) < 8;
    if (near) {
      EXPECT_GT(patch.covered, 0.2) << patch.azimuth_deg;
    }
    if (patch.elevation_deg < 40) {
      EXPECT_EQ(patch.covered, 0) << patch.azimuth_deg << " " << patch.elevation_deg;
    }
  }
  show(pose, test::uniform_light());  // the same view again
  EXPECT_EQ(coverage_.views(), 1);
  EXPECT_LT(coverage_.gain({&pose, 1}), 0.2 * promised);
}

// The same views of a scene cover less of it when the lamp in it was seen from one cell only.
TEST_F(CoverageTest, ALampIsWantedFromEveryCell) {
  const test::Surroundings lamp = test::lamp_in_a_dark_room();
  Coverage even(test::desk_coverage(), reach_);
  const sim::MotionInput input{reach_.camera_in_world(), {0.35, 0.45, 0.8}, {0.235, 0.195}};
  const std::vector<Rigid3> poses = sim::wave_mirror(input, 500, 1);  // the last two fifths sweep the lamp
  for (std::size_t i = 0; i < 300; ++i) {
    show(poses[i], lamp);
    even.add(reach_.cam_from_world() * poses[i], test::mirrored(reach_, poses[i], test::uniform_light(), 8), 8);
  }
  const double before = coverage_.status().covered, uniform = even.status().covered;
  EXPECT_LT(before, 0.75 * uniform);
  for (std::size_t i = 300; i < 500; ++i) {
    show(poses[i], lamp);
    even.add(reach_.cam_from_world() * poses[i], test::mirrored(reach_, poses[i], test::uniform_light(), 8), 8);
  }
  EXPECT_GT(coverage_.status().covered, before + 0.15);
  EXPECT_LT(even.status().covered, uniform + 0.05);  // the sweep tells nothing new where all is alike
  // The lamp's patch bears a good part of the light.
  const CoverageStatus status = coverage_.status();
  const CoveragePatch& brightest = *std::max_element(status.patches.begin(), status.patches.end(),
                                                     [](auto& a, auto& b) { return a.weight < b.weight; });
  EXPECT_GT(brightest.weight, 0.1);
  EXPECT_NEAR(brightest.azimuth_deg, std::atan2(0.45, 0.35) / degree, 15);
  EXPECT_NEAR(brightest.elevation_deg, 54, 12);
}

TEST_F(CoverageTest, OptionsAreChecked) {
  CoverageOptions options;
  options.cells = 0;
  EXPECT_THROW(Coverage(options, reach_), InputError);
  options = {};
  options.plane.size_m.x() = -1;
  EXPECT_TRUE(options.validate());
}

TEST(LightPlane, LiesBetweenTheTags) {
  const LightPlane plane = plane_between(sim::desk_scene(1).world);
  EXPECT_TRUE(plane.centre_in_world.isApprox(Eigen::Vector2d(0, 0.01)));
  EXPECT_TRUE(plane.size_m.isApprox(Eigen::Vector2d(0.48, 0.34)));
  WorldTarget one;
  one.tags = {{5, 0.08, {1, 2, 0}}};
  EXPECT_TRUE(plane_between(one).centre_in_world.isApprox(Eigen::Vector2d(1, 2)));
  EXPECT_GT(plane_between(one).size_m.minCoeff(), 0.3);
}

// Guidance asks for what leads there: after obeying its words exactly, the mirror is nearer to the place.
TEST_F(CoverageTest, AdviceLeadsToThePlace) {
  std::mt19937 random(4);
  int asked = 0;
  for (int trial = 0; trial < 25; ++trial) {
    Guidance guidance;
    const Vector3d direction = random_direction(random);
    const auto start = reach_.showing({0, 0, 0}, direction, reach_.picture_right());
    if (!start) continue;
    const Rigid3 cam_from_mirror = reach_.cam_from_world() * *start;
    ASSERT_TRUE(guidance.advise(coverage_, cam_from_mirror, 0));
    ASSERT_TRUE(guidance.wanted());
    const Rigid3 wanted = reach_.cam_from_world() * *guidance.wanted();
    const HandMotion& m = guidance.motion();
    const Vector3d shifted = cam_from_mirror.translation + 0.01 * m.move.cast<double>();
    if (!m.move.isZero()) {
      EXPECT_LT((wanted.translation - shifted).norm(), (wanted.translation - cam_from_mirror.translation).norm());
    }
    if (m.tilt.isZero()) continue;
    ++asked;
    // The named edge or corner comes nearer to the camera.
    const Vector3d axis = Vector3d(-m.tilt.y(), m.tilt.x(), 0).normalized();
    const Vector3d normal = cam_from_mirror.rotation * Vector3d::UnitZ();
    const Vector3d part(m.tilt.x(), m.tilt.y(), 0);
    EXPECT_LT((Eigen::AngleAxisd(0.01, axis) * part).z(), 0);
    EXPECT_GT((Eigen::AngleAxisd(0.01, axis) * normal).dot(wanted.rotation * Vector3d::UnitZ()),
              normal.dot(wanted.rotation * Vector3d::UnitZ()));
  }
  EXPECT_GT(asked, 8);
}

TEST(Guidance, SpeaksPlainly) {
  EXPECT_EQ(sentence({{-1, 0, 0}, {0, 0}, true, false}), "move it left a little");
  EXPECT_EQ(sentence({{0, 0, 0}, {0, -1}, false, false}), "tilt the top edge towards the camera");
  EXPECT_EQ(sentence({{1, 1, 0}, {1, -1}, false, true}),
            "move it down and right, tilt the top right corner towards the camera a little");
  EXPECT_EQ(sentence({{0, 0, 1}, {0, 0}, false, false}), "move it away from the camera");
  EXPECT_EQ(sentence({}), "good: go on around here");
}

// Whether a hand that waves at random has covered as much when it has had 1 / 0.6 of the guided one's frames. The long
// variant (guided_capture_test.cpp) counts how many it needs.
TEST(GuidedCapture, NeedsAtMostThreeFifthsOfTheFrames) {
  CoverageOptions coarse = test::desk_coverage();  // fewer frames to simulate
  coarse.patch_deg = 12;
  coarse.cells = 5;
  int better = 0;
  const std::vector<test::Surroundings> scenes{test::lamp_in_a_dark_room(), test::windows_and_sky(),
                                               test::uniform_light()};
  for (const test::Surroundings& scene : scenes) {
    const test::Waved guided = test::wave(test::Waving::guided, scene, coarse, 1, 2000);
    EXPECT_TRUE(guided.reached);
    const test::Waved random =
        test::wave(test::Waving::random, scene, coarse, 1, static_cast<int>(guided.frames / 0.6));
    std::cout << fmt::format("guided {} frames to {:.3f}, random {} to {:.3f}\n", guided.frames, guided.covered.back(),
                             random.frames, random.covered.back());
    better += guided.reached && !random.reached ? 1 : 0;
  }
  EXPECT_GE(better, 2);  // of three: the median
}

}  // namespace
}  // namespace mf
