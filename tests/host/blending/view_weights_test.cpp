// SPDX-License-Identifier: Apache-2.0
#include "host/blending/view_weights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "host/blending/ray_penalty.h"

namespace mf {
namespace {

constexpr float floor_ = 1e-6F;
constexpr float infinite = std::numeric_limits<float>::infinity();

// Weights by view; 0 for those that do not speak.
std::map<std::uint32_t, float> weights_of(const std::vector<float>& penalties, int k) {
  std::vector<ViewPenalty> candidates;
  for (std::uint32_t i = 0; i < penalties.size(); ++i) candidates.push_back({i, penalties[i]});
  std::vector<ViewWeight> out(static_cast<std::size_t>(k));
  const std::size_t count = blend_weights(candidates, k, floor_, out);
  std::map<std::uint32_t, float> weights;
  for (std::size_t i = 0; i < count; ++i) weights[out[i].view] = out[i].weight;
  return weights;
}

TEST(ViewWeights, FollowThePapersFormula) {
  // k = 2 of three: threshold 0.4; (1 − 0.25)/0.1 = 7.5 and (1 − 0.5)/0.2 = 2.5.
  auto weights = weights_of({0.2F, 0.4F, 0.1F}, 2);
  EXPECT_NEAR(weights[2], 0.75, 1e-4);
  EXPECT_NEAR(weights[0], 0.25, 1e-4);
  EXPECT_EQ(weights.count(1), 0U);
}

TEST(ViewWeights, AViewThatSawTheRaySpeaksAlone) {
  EXPECT_GT(weights_of({0.1F, 0.0F, 0.05F, 0.2F}, 3)[1], 0.9999F);
}

TEST(ViewWeights, ACandidateThatLeavesTakesNoWeightWithIt) {
  // The third view's penalty rises to infinity as it fades out at its border: the others' weights tend to what they are
  // without it.
  auto nearly_gone = weights_of({0.1F, 0.2F, 1e6F}, 2);
  auto gone = weights_of({0.1F, 0.2F, infinite}, 2);
  auto never_there = weights_of({0.1F, 0.2F}, 2);
  for (const std::uint32_t view : {0U, 1U}) {
    EXPECT_NEAR(nearly_gone[view], gone[view], 1e-5);
    EXPECT_NEAR(never_there[view], gone[view], 1e-6);
  }
  EXPECT_LT(weights_of({0.1F, 1e6F}, 2)[1], 1e-6F);
}

TEST(ViewWeights, SwapWithoutAJumpAtTheThreshold) {
  auto before = weights_of({0.1F, 0.2F, 0.3F, 0.3001F}, 3);
  auto after = weights_of({0.1F, 0.2F, 0.3001F, 0.3F}, 3);
  EXPECT_LT(before[2], 1e-3F);
  EXPECT_LT(after[3], 1e-3F);
  EXPECT_NEAR(before[0], after[0], 1e-3);
}

TEST(ViewWeights, TiesShareEvenlyAndNothingIsLost) {
  for (const float penalty : {0.0F, 0.3F}) {
    auto weights = weights_of(std::vector<float>(6, penalty), 4);
    ASSERT_EQ(weights.size(), 4U);
    for (const auto& [view, weight] : weights) EXPECT_NEAR(weight, 0.25, 1e-5) << view;
  }
}

TEST(ViewWeights, NobodySpeaksWhereEveryPenaltyIsInfinite) {
  EXPECT_TRUE(weights_of({infinite, infinite}, 2).empty());
}

TEST(RayPenalty, RisesToInfinityAtTheBorderAndIsZeroForTheVeryRay) {
  const PenaltyOptions options{4, 1, 0.1F, 0.5F};
  EXPECT_EQ(penalty_of(options, {0, 0, 1e-4F}), 0);
  EXPECT_FLOAT_EQ(penalty_of(options, {0.2F, 1, 0.25F}), 0.3F / 0.5F);
  EXPECT_EQ(penalty_of(options, {0.2F, 1, 0}), infinite);
}

TEST(RayPenalty, CoarsenessIsOctavesOfLengthAndOneSided) {
  EXPECT_FLOAT_EQ(coarseness(0.25F, 1), 1);
  EXPECT_FLOAT_EQ(coarseness(4, 1), 0);
  EXPECT_FLOAT_EQ(coarseness(0, 1), 32);
}

TEST(RayPenalty, ApproximateLogarithmIsWithinItsBound) {
  float worst = 0;
  float last = -infinite;
  for (float value = 1e-6F; value < 1e6F; value *= 1.00037F) {
    const float log2 = approximate_log2(value);
    worst = std::max(worst, std::abs(log2 - std::log2(value)));
    EXPECT_GE(log2, last - 1e-6F) << value;
    last = log2;
  }
  EXPECT_LT(worst, 2e-5F);
  EXPECT_NEAR(approximate_log2(1), 0, 1e-7);
}

}  // namespace
}  // namespace mf
