// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "common/robust_homography.h"
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

// The tags without their z. Precondition: they lie in one plane of constant z.
[[nodiscard]] inline std::vector<TagInPlane> in_plane(const std::vector<TagSighting>& tags) {
  std::vector<TagInPlane> out;
  out.reserve(tags.size());
  for (const TagSighting& tag : tags) {
    TagInPlane flat{{}, tag.corners_px};
    for (std::size_t k = 0; k < 4; ++k) flat.in_plane[k] = tag.corners_in_target[k].head<2>();
    out.push_back(flat);
  }
  return out;
}

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
