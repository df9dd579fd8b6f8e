// SPDX-License-Identifier: Apache-2.0
#include "common/rigid3.h"

#include <gtest/gtest.h>

namespace mf {
namespace {

Rigid3 example(double angle, double shift) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, -0.5).normalized())),
          {shift, -2 * shift, 0.3}};
}

TEST(Rigid3, ComposesLikeItsMatrices) {
  const Rigid3 a_from_b = example(0.7, 1.5), b_from_c = example(-2.1, 0.2);
  EXPECT_TRUE((a_from_b * b_from_c).matrix().isApprox(a_from_b.matrix() * b_from_c.matrix(), 1e-12));
}

TEST(Rigid3, InverseUndoes) {
  const Rigid3 a_from_b = example(2.9, -0.4);
  EXPECT_TRUE((a_from_b.inverse() * a_from_b).matrix().isIdentity(1e-12));
}

TEST(Rigid3, RefusesAReflection) {
  EXPECT_FALSE(Rigid3::from_matrix(Eigen::Vector4d(1, 1, -1, 1).asDiagonal()).has_value());
  EXPECT_TRUE(Rigid3::from_matrix(example(1, 1).matrix()).has_value());
}

}  // namespace
}  // namespace mf
