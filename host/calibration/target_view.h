// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "host/calibration/tag_refinement.h"

namespace mf {

// One tag of a rigid target, seen in one picture.
struct TagSighting {
  int id = 0;
  std::array<Eigen::Vector3d, 4> corners_in_target;  // metres, in the order of TagDetection::corners_px
  TagCorners corners_px;
  Eigen::Matrix<double, 8, 8> information;  // inverse covariance of the corners, px⁻²: see RefinedTag
  bool inlier = true;
};

// A rigid target (the mirror with its frame, or the scene's own tags) as one picture shows it.
struct TargetView {
  std::string name;
  std::vector<TagSighting> tags;

  [[nodiscard]] int inlier_count() const {
    int count = 0;
    for (const TagSighting& tag : tags) count += tag.inlier ? 1 : 0;
    return count;
  }
};

// Independent corners, all equally good: for corners that come without a covariance.
[[nodiscard]] inline Eigen::Matrix<double, 8, 8> isotropic_information(double sigma_px) {
  return Eigen::Matrix<double, 8, 8>::Identity() / (sigma_px * sigma_px);
}

}  // namespace mf
