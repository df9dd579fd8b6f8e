// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/plane_blend.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "host/blending/view_weights.h"
#include "host/light_field/half_floats.h"

namespace mf {
namespace {

// In the frame of the wanted direction, up to rays that go the other way.
TEST(PlaneBlend, PenaltiesAreAnglesOverWeights) {
  Lanes3 p;
  set_points({0.1F, 0.2F, 0}, {0.01F, 0, 0}, {0, -0.01F, 0}, p);
  std::array<std::uint16_t, block_lanes> weights;
  weights.fill(to_half(0.5F));
  weights[9] = 0;
  Lanes inverse;
  for (const Eigen::Vector3f& centre : {Eigen::Vector3f(0.1F, 0.19F, -0.7F), Eigen::Vector3f(0.6F, 0.4F, -0.7F),
                                        Eigen::Vector3f(3, 1, -0.01F), Eigen::Vector3f(-1, 1, 0.4F)}) {
    inverse_penalties(p, centre, weights.data(), inverse);
    EXPECT_EQ(inverse.v[9], 0);
    for (const std::size_t i : {0U, 7U, 35U, 63U}) {
      const Eigen::Vector3f ray = Eigen::Vector3f(p.x.v[i], p.y.v[i], p.z.v[i]) - centre;
      const float angle = std::atan2(ray.head<2>().norm(), ray.z());
      EXPECT_NEAR(1 / inverse.v[i] - same_ray_rad, angle / 0.5F, 1e-4F + 1e-4F * angle);
      const float chord = (ray.normalized() - Eigen::Vector3f::UnitZ()).norm();
      EXPECT_NEAR(inverse_penalty(chord, 0.5F) / inverse.v[i], 1, 2e-3F);
    }
  }
}

// What is summed over a block's views is what the definition says of each ray, whatever the number of views.
TEST(PlaneBlend, SumsAreBuehlers) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<Lanes> sinking;
  for (const std::size_t k : {1U, 4U, 15U, 64U})
    for (const std::size_t count : {std::size_t{1}, std::size_t{3}, std::size_t{20}, std::size_t{80}}) {
      std::vector<Lanes> inverses(count);
      std::vector<std::array<std::uint16_t, 4 * block_lanes>> texels(count);
      for (std::size_t c = 0; c < count; ++c)
        for (std::size_t i = 0; i < block_lanes; ++i) {
          const bool sees = uniform(random) > 0.2F;
          inverses[c].v[i] = sees ? 1 / (uniform(random) * uniform(random) + same_ray_rad) : 0;
          for (std::size_t channel = 0; channel < 4; ++channel)
            texels[c][channel * block_lanes + i] = sees ? to_half(0.1F + 0.9F * uniform(random)) : std::uint16_t{0};
        }
      Lanes threshold, confidence;
      inverse_thresholds(inverses, k, 0, sinking, threshold);
      ViewSums sums{};
      for (std::size_t c = 0; c < count; ++c) add_view(inverses[c], threshold, texels[c].data(), 2, sums);
      Lanes3 colour;
      finish(sums, colour, confidence);
      for (std::size_t i = 0; i < block_lanes; ++i) {
        std::vector<ViewPenalty> candidates;
        for (std::uint32_t c = 0; c < count; ++c)
          if (inverses[c].v[i] > 0) candidates.push_back({c, 1 / inverses[c].v[i] - same_ray_rad});
        std::vector<ViewWeight> expected(k);
        const std::size_t speaking = blend_weights(candidates, static_cast<int>(k), same_ray_rad, expected);
        float green = 0, seen = 0;
        for (std::size_t s = 0; s < speaking; ++s) {
          const auto& texel = texels[expected[s].view];
          green += expected[s].weight * 2 * half_unshift * shifted_half(texel[block_lanes + i]);
          seen += half_unshift * shifted_half(texel[3 * block_lanes + i]);
        }
        ASSERT_NEAR(colour.y.v[i], green, 2e-3F * green) << k << ' ' << count;
        ASSERT_NEAR(confidence.v[i], std::min(seen, 1.0F), 1e-5F);
      }
    }
}

// Views that tie with the threshold, as copies of one frame do, have seen the texel: it is no hole.
TEST(PlaneBlend, TiesAreNoHoles) {
  std::vector<Lanes> inverses(3), sinking;
  for (Lanes& inverse : inverses) inverse.v.fill(2);
  std::array<std::uint16_t, 4 * block_lanes> texels;
  texels.fill(to_half(0.5F));
  Lanes threshold, confidence;
  inverse_thresholds(inverses, 2, 0, sinking, threshold);
  ViewSums sums{};
  for (const Lanes& inverse : inverses) add_view(inverse, threshold, texels.data(), 1, sums);
  Lanes3 colour;
  finish(sums, colour, confidence);
  EXPECT_NEAR(colour.x.v[9], 0.5F, 1e-4F);
  EXPECT_GT(confidence.v[9], 0);
}

// Only views above a bound are given: where fewer than k + 1 are, the bound is the threshold.
TEST(PlaneBlend, ThresholdIsNotBelowItsBound) {
  std::vector<Lanes> inverses(3), sinking;
  for (std::size_t c = 0; c < 3; ++c) inverses[c].v.fill(static_cast<float>(c + 1));
  Lanes threshold;
  inverse_thresholds(inverses, 2, 0.5F, sinking, threshold);
  EXPECT_EQ(threshold.v[5], 1);
  inverse_thresholds(inverses, 3, 0.5F, sinking, threshold);
  EXPECT_EQ(threshold.v[5], 0.5F);
  inverse_thresholds(inverses, 1, 2.5F, sinking, threshold);
  EXPECT_EQ(threshold.v[5], 2.5F);
}

}  // namespace
}  // namespace mf
