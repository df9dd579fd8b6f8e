// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/plane_blend.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "host/blending/view_weights.h"
#include "host/light_field/block_blend.h"
#include "host/light_field/half_floats.h"

namespace mf {
namespace {

using Shown = std::array<std::uint16_t, quarter_halves>;

// Up to rays that go the other way.
TEST(PlaneBlend, PenaltiesAreAnglesOverWeights) {
  Shown shown;
  shown.fill(to_half(0.5F));
  shown[3 * quarter_lanes + 9] = 0;
  const Eigen::Vector3f first(0.1F, 0.2F, 0), step_x(0.01F, 0, 0), step_y(0, -0.01F, 0);
  const Eigen::Vector3f direction = Eigen::Vector3f(0.1F, -0.2F, 0.9F).normalized();
  for (const Eigen::Vector3f& centre : {Eigen::Vector3f(0.1F, 0.19F, -0.7F), Eigen::Vector3f(0.6F, 0.4F, -0.7F),
                                        Eigen::Vector3f(3, 1, -0.01F), Eigen::Vector3f(-1, 1, 0.4F)}) {
    QuarterRays rays;
    look_from(centre, first, step_x, step_y, shown.data(), rays);
    std::array<QuarterView, 1> view{{{&rays, shown.data(), 1}}};
    Quarter inverse;
    ASSERT_EQ(inverse_penalties(direction, 0, view, &inverse), 1U);
    EXPECT_EQ(inverse.v[9], 0);
    for (const std::size_t i : {0U, 7U, 10U, 15U}) {
      const auto [x, y] = texel_of(0, i);
      const Eigen::Vector3f ray = first + static_cast<float>(x) * step_x + static_cast<float>(y) * step_y - centre;
      const float angle = std::atan2(ray.cross(direction).norm(), ray.dot(direction));
      EXPECT_NEAR(1 / inverse.v[i] - same_ray_rad, angle / 0.5F, 1e-4F + 1e-4F * angle);
      const float chord = (ray.normalized() - direction).norm();
      EXPECT_NEAR(inverse_penalty(chord, 0.5F) / inverse.v[i], 1, 2e-3F);
    }
    EXPECT_EQ(inverse_penalties(direction, 1e6F, view, &inverse), 0U) << "a bound that no view exceeds";
  }
}

// All texels of a block, once each.
TEST(PlaneBlend, QuartersTileABlock) {
  std::array<int, block_lanes> covered{};
  for (std::size_t q = 0; q < quarters; ++q)
    for (std::size_t i = 0; i < quarter_lanes; ++i) {
      const auto [x, y] = texel_of(q, i);
      ++covered.at(static_cast<std::size_t>(y * block_side + x));
    }
  for (const int times : covered) EXPECT_EQ(times, 1);
}

float half_value(std::uint16_t half) {
  return half_unshift * shifted_half(half);
}

// What is summed over a quarter's views is what the definition says of each ray, whatever the number of views.
TEST(PlaneBlend, SumsAreBuehlers) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const std::size_t k : {1U, 4U, 15U, 16U, 64U})
    for (const std::size_t count : {std::size_t{1}, std::size_t{3}, std::size_t{20}, std::size_t{80}}) {
      std::vector<Quarter> inverses(count);
      std::vector<Shown> shown(count);
      std::vector<QuarterView> views;
      for (std::size_t c = 0; c < count; ++c) {
        for (std::size_t i = 0; i < quarter_lanes; ++i) {
          const bool sees = uniform(random) > 0.2F;
          inverses[c].v[i] = sees ? 1 / (uniform(random) * uniform(random) + same_ray_rad) : 0;
          for (std::size_t channel = 0; channel < 4; ++channel)
            shown[c][channel * quarter_lanes + i] = sees ? to_half(0.1F + 0.9F * uniform(random)) : std::uint16_t{0};
        }
        views.push_back({nullptr, shown[c].data(), 2});
      }
      Quarter threshold;
      inverse_thresholds(inverses, k, 0, threshold);
      BlendedQuarter blended;
      blend(views, inverses.data(), threshold, blended);
      for (std::size_t i = 0; i < quarter_lanes; ++i) {
        std::vector<ViewPenalty> candidates;
        for (std::uint32_t c = 0; c < count; ++c)
          if (inverses[c].v[i] > 0) candidates.push_back({c, 1 / inverses[c].v[i] - same_ray_rad});
        std::vector<ViewWeight> expected(k);
        const std::size_t speaking = blend_weights(candidates, static_cast<int>(k), same_ray_rad, expected);
        float green = 0, seen = 0;
        for (std::size_t s = 0; s < speaking; ++s) {
          const Shown& texels = shown[expected[s].view];
          green += expected[s].weight * 2 * half_value(texels[quarter_lanes + i]);
          seen += half_value(texels[3 * quarter_lanes + i]);
        }
        ASSERT_NEAR(blended.green.v[i], green, 2e-3F * green) << k << ' ' << count;
        ASSERT_NEAR(blended.confidence.v[i], std::min(seen, 1.0F), 1e-5F);
      }
    }
}

std::vector<Quarter> all_texels(std::initializer_list<float> values) {
  std::vector<Quarter> quarters;
  for (const float value : values) quarters.push_back({Quarter::Vector{} + value});
  return quarters;
}

// Views that tie with the threshold, as copies of one frame do, have seen the texel: it is no hole.
TEST(PlaneBlend, TiesAreNoHoles) {
  const std::vector<Quarter> inverses = all_texels({2, 2, 2});
  Shown shown;
  shown.fill(to_half(0.5F));
  const std::vector<QuarterView> views(3, {nullptr, shown.data(), 1});
  Quarter threshold;
  inverse_thresholds(inverses, 2, 0, threshold);
  BlendedQuarter blended;
  blend(views, inverses.data(), threshold, blended);
  EXPECT_NEAR(blended.red.v[9], 0.5F, 1e-4F);
  EXPECT_GT(blended.confidence.v[9], 0);
}

// Only views above a bound are given: where fewer than k + 1 are, the bound is the threshold.
TEST(PlaneBlend, ThresholdIsNotBelowItsBound) {
  const std::vector<Quarter> inverses = all_texels({1, 2, 3});
  Quarter threshold;
  inverse_thresholds(inverses, 2, 0.5F, threshold);
  EXPECT_EQ(threshold.v[5], 1);
  inverse_thresholds(inverses, 3, 0.5F, threshold);
  EXPECT_EQ(threshold.v[5], 0.5F);
  inverse_thresholds(inverses, 1, 2.5F, threshold);
  EXPECT_EQ(threshold.v[5], 2.5F);
}

}  // namespace
}  // namespace mf
