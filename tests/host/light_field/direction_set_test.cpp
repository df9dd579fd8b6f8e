// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/direction_set.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

namespace mf {
namespace {

TEST(DirectionSet, CellsTileTheHemisphere) {
  for (const int count : {11, 50, 500, 2500, 9000}) {
    const DirectionSet set = geodesic_hemisphere(count);
    const double sum = std::accumulate(set.solid_angles_sr.begin(), set.solid_angles_sr.end(), 0.0);
    EXPECT_NEAR(sum, 2 * std::numbers::pi, 1e-4) << count;
  }
}

// The smallest division that is not below what was asked for.
TEST(DirectionSet, HoldsAtLeastAsManyAsAskedFor) {
  for (const int count : {1, 11, 100, 2476, 2477, 9000}) {
    const DirectionSet set = geodesic_hemisphere(count);
    EXPECT_GE(set.size(), static_cast<std::size_t>(count));
    if (set.frequency == 1) continue;
    EXPECT_LT(geodesic_hemisphere_of_frequency(set.frequency - 1).size(), static_cast<std::size_t>(count));
  }
}

// ∫ cos θ dω over the hemisphere is π; ∫ x² dω is 2π/3: both by the set's own directions and solid angles.
TEST(DirectionSet, IntegratesSmoothFunctions) {
  const DirectionSet set = geodesic_hemisphere(2500);
  double cosine = 0, square = 0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    EXPECT_NEAR(set.directions[i].norm(), 1, 1e-5);
    EXPECT_GT(set.directions[i].z(), 0);
    cosine += static_cast<double>(set.solid_angles_sr[i]) * static_cast<double>(set.directions[i].z());
    square += static_cast<double>(set.solid_angles_sr[i]) * std::pow(static_cast<double>(set.directions[i].x()), 2);
  }
  EXPECT_NEAR(cosine, std::numbers::pi, 2e-3);
  EXPECT_NEAR(square, 2 * std::numbers::pi / 3, 2e-3);
}

TEST(DirectionSet, SplitCellsKeepTheirSolidAngle) {
  const DirectionSet set = geodesic_hemisphere(500);
  for (std::size_t i = 0; i < set.size(); i += 7)
    for (const int splits : {0, 1, 3}) {
      const auto parts = split_cell(set, i, splits);
      double sum = 0;
      for (const CellSample& part : parts) sum += static_cast<double>(part.solid_angle_sr);
      EXPECT_NEAR(sum / static_cast<double>(set.solid_angles_sr[i]), 1, 1e-3);
      EXPECT_EQ(parts.size(), set.cell(i).size() << splits);
    }
}

// Barycentric weights reproduce the direction itself, and every direction of the set finds itself.
TEST(DirectionLocator, InterpolatesDirections) {
  const DirectionSet set = geodesic_hemisphere(2500);
  const DirectionLocator locator(set);
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  for (int n = 0; n < 20000; ++n) {
    Eigen::Vector3f d = Eigen::Vector3f(normal(random), normal(random), std::abs(normal(random))).normalized();
    if (d.z() < 0.05F) continue;  // beyond the rim a direction is only clamped
    const DirectionWeights w = locator.locate(d);
    Eigen::Vector3f back = Eigen::Vector3f::Zero();
    for (std::size_t i = 0; i < 3; ++i) back += w.weight[i] * set.directions[w.index[i]];
    ASSERT_LT((back.normalized() - d).norm(), 2e-4F) << d.transpose();
  }
  const DirectionWeights self = locator.locate(set.directions[1234]);
  float own = 0;
  for (std::size_t i = 0; i < 3; ++i)
    if (self.index[i] == 1234) own += self.weight[i];
  EXPECT_NEAR(own, 1, 1e-3);
}

TEST(DirectionLocator, ClampsBelowTheRim) {
  const DirectionSet set = geodesic_hemisphere(500);
  const DirectionLocator locator(set);
  for (int a = 0; a < 360; a += 5) {
    const float r = static_cast<float>(a) * std::numbers::pi_v<float> / 180;
    const DirectionWeights w = locator.locate(Eigen::Vector3f(std::cos(r), std::sin(r), 0));
    Eigen::Vector3f back = Eigen::Vector3f::Zero();
    for (std::size_t i = 0; i < 3; ++i) back += w.weight[i] * set.directions[w.index[i]];
    EXPECT_GT(back.normalized().dot(Eigen::Vector3f(std::cos(r), std::sin(r), 0)), std::cos(0.1F));
  }
}

}  // namespace
}  // namespace mf
