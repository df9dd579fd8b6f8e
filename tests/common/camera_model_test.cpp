// SPDX-License-Identifier: Apache-2.0
#include "common/camera_model.h"

#include <gtest/gtest.h>

namespace mf {
namespace {

CameraModel distorted() {
  return {768, 512, {900, 905, 380, 260, -0.22, 0.09, 0.001, -0.0015, -0.01}};
}

// Expected values: OpenCV 4.6 cv2.projectPoints with the same parameters (which knows no pixel centres: K decides).
TEST(CameraModel, ProjectsLikeOpenCv) {
  const Eigen::Vector2d p = distorted().project({0.3, -0.2, 1.1});
  EXPECT_NEAR(p.x(), 619.469718352140, 1e-9);
  EXPECT_NEAR(p.y(), 99.466596215787, 1e-9);
}

TEST(CameraModel, UnprojectInvertsProject) {
  const CameraModel camera = distorted();
  for (double u = 5; u < 768; u += 76)
    for (double v = 5; v < 512; v += 50) {
      const auto ray = camera.unproject({u, v});
      ASSERT_TRUE(ray.has_value());
      EXPECT_LT((camera.project(*ray) - Eigen::Vector2d(u, v)).norm(), 1e-8);
    }
}

TEST(CameraModel, PixelCentreOfACentredPinhole) {
  const CameraModel camera{4, 4, {10, 10, 2, 2, 0, 0, 0, 0, 0}};
  EXPECT_EQ(camera.project({0, 0, 1}), Eigen::Vector2d(2, 2));  // the corner that the four middle pixels share
}

}  // namespace
}  // namespace mf
