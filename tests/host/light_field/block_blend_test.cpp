// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/block_blend.h"

#include <gtest/gtest.h>
#include <half.h>

#include <cmath>
#include <limits>
#include <random>

#include "host/blending/view_weights.h"
#include "host/light_field/half_floats.h"
#include "host/light_field/view_ranking.h"
#include "host/light_field/view_rays.h"

namespace mf {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

// The weights of a block are those of its rays, one by one.
TEST(BlockBlend, WeightsAreBuehlers) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const int k : {1, 4, 15, 64})
    for (const std::size_t count : {std::size_t{1}, std::size_t{3}, std::size_t{20}, std::size_t{80}}) {
      std::vector<Lanes> penalties(count), weights(count);
      for (std::size_t c = 0; c < count; ++c)
        for (std::size_t i = 0; i < block_lanes; ++i) {
          penalties[c].v[i] = uniform(random) < 0.2F ? infinity : uniform(random) * uniform(random);
          weights[c].v[i] = 0.1F + 0.9F * uniform(random);
        }
      const std::vector<Lanes> given = penalties;
      Lanes confidence;
      weights_of(penalties, weights, k, 1e-4F, confidence);
      for (std::size_t i = 0; i < block_lanes; ++i) {
        std::vector<ViewPenalty> candidates;
        for (std::uint32_t c = 0; c < count; ++c)
          if (given[c].v[i] < infinity) candidates.push_back({c, given[c].v[i]});
        std::vector<ViewWeight> expected(static_cast<std::size_t>(k));
        const std::size_t speaking = blend_weights(candidates, k, 1e-4F, expected);
        std::vector<float> by_view(count, 0.0F);
        float seen = 0;
        for (std::size_t s = 0; s < speaking; ++s) {
          by_view[expected[s].view] = expected[s].weight;
          seen += weights[expected[s].view].v[i];
        }
        for (std::size_t c = 0; c < count; ++c)
          ASSERT_NEAR(penalties[c].v[i] * weights[c].v[i], by_view[c], 2e-5F) << k << ' ' << count;
        ASSERT_NEAR(confidence.v[i], std::min(seen, 1.0F), 1e-5F);
      }
    }
}

TEST(BlockBlend, PenaltiesAreThoseOfTheRays) {
  Lanes3 p;
  set_points({0.1F, 0.2F, 0}, {0.01F, 0, 0}, {0, -0.01F, 0}, p);
  const Eigen::Vector3f direction = Eigen::Vector3f(0.3F, -0.2F, 0.9F).normalized(), centre(0.05F, 0.4F, -0.7F);
  Patch<Eigen::Vector4f> focus;
  for (std::size_t i = 0; i < focus.size(); ++i)
    focus[i] = proxy_point({0.1F, 0.2F, 0}, direction, 0.5F + 0.01F * static_cast<float>(i));
  Lanes4 x;
  interpolate(focus, x);
  Lanes weight, distance;
  weight.v.fill(0.5F);
  weight.v[9] = 0.01F;
  distance_penalties(p, x, centre, weight, distance);
  EXPECT_EQ(distance.v[9], infinity);
  for (const std::size_t i : {0U, 7U, 35U, 63U}) {
    const Eigen::Vector3f at(p.x.v[i], p.y.v[i], p.z.v[i]);
    const ProxyPoint here(x.x.v[i], x.y.v[i], x.z.v[i], x.w.v[i]);
    EXPECT_NEAR(distance.v[i], ray_distance(at, here, centre) / 0.5F, 1e-5F);
  }
}

TEST(ViewRanking, FindsTheLeastWhateverItLookedForBefore) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(0, 1);
  ViewRanking search;
  for (int round = 0; round < 200; ++round) {
    const float scale = std::pow(10.0F, 12 * uniform(random) - 6);
    std::vector<float> bounds, penalties;
    for (int i = 0; i < 100; ++i) {
      bounds.push_back(scale * uniform(random));
      penalties.push_back(uniform(random) < 0.3F ? infinity : bounds.back() * (1 + 5 * uniform(random)));
    }
    std::vector<float> expected = penalties;
    std::sort(expected.begin(), expected.end());
    std::vector<bool> announced(bounds.size(), false);
    const auto penalty_of = [&](std::size_t i) {
      EXPECT_TRUE(announced[i]);
      return penalties[i];
    };
    const auto& found =
        search.find(bounds.data(), bounds.size(), 9, penalty_of, [&](std::size_t i) { announced[i] = true; });
    ASSERT_EQ(found.size(), 9U);
    std::vector<float> values;
    for (const ViewPenalty& v : found) {
      EXPECT_EQ(v.penalty, penalties[v.view]);
      values.push_back(v.penalty);
    }
    std::sort(values.begin(), values.end());
    EXPECT_TRUE(std::equal(values.begin(), values.end(), expected.begin()));
  }
}

// OpenEXR's half is the truth.
TEST(HalfFloats, RoundAsOpenExrDoes) {
  std::mt19937 random(13);
  std::uniform_real_distribution<float> exponent(-27, 17);
  for (int i = 0; i < 200000; ++i) {
    const float value = std::exp2(exponent(random));
    ASSERT_EQ(to_half(value), half(std::min(value, 65504.0F)).bits()) << value;
  }
  EXPECT_EQ(to_half(-1.0F), 0);
  EXPECT_EQ(to_half(1e30F), half(65504.0F).bits());
  EXPECT_EQ(to_half(std::numeric_limits<float>::quiet_NaN()), 0);
  for (std::uint16_t h = 0x0400; h < 0x7c00; ++h) {
    half truth;
    truth.setBits(h);
    ASSERT_EQ(shifted_half(h) * half_unshift, static_cast<float>(truth));
    ASSERT_EQ(to_normal_half(static_cast<float>(truth)), h);
  }
  EXPECT_EQ(to_normal_half(1e-6F), 0);
}

}  // namespace
}  // namespace mf
