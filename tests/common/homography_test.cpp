// SPDX-License-Identifier: Apache-2.0
#include "common/homography.h"

#include <gtest/gtest.h>

#include <vector>

namespace mf {
namespace {

TEST(Homography, RecoversAKnownMap) {
  const Homography truth{(Eigen::Matrix3d() << 120, 4, 300, -7, 110, 200, 0.05, -0.02, 1).finished()};
  std::vector<Eigen::Vector2d> source, target;
  for (double x : {-1.0, -0.3, 0.4, 1.0})
    for (double y : {-0.8, 0.1, 0.9}) {
      source.emplace_back(x, y);
      target.push_back(truth * source.back());
    }
  const auto fitted = fit_homography(source, target);
  ASSERT_TRUE(fitted.has_value());
  for (const Eigen::Vector2d& p : source) EXPECT_LT((*fitted * p - truth * p).norm(), 1e-9);
  EXPECT_LT((fitted->inverse() * (*fitted * source[3]) - source[3]).norm(), 1e-12);
}

TEST(Homography, RefusesPointsOnALine) {
  std::vector<Eigen::Vector2d> source, target;
  for (int i = 0; i < 6; ++i) {
    source.emplace_back(i, 2 * i);
    target.emplace_back(3 * i, i);
  }
  EXPECT_FALSE(fit_homography(source, target).has_value());
  EXPECT_FALSE(fit_homography(std::vector<Eigen::Vector2d>(3), std::vector<Eigen::Vector2d>(3)).has_value());
}

}  // namespace
}  // namespace mf
