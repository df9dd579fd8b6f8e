// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "common/homography.h"

namespace mf {

// A tag's corners in a plane and where a picture shows them, in the order of PlanarTag::corners_m().
struct TagInPlane {
  std::array<Eigen::Vector2d, 4> in_plane;
  std::array<Eigen::Vector2d, 4> in_picture;
};

struct RobustHomography {
  Homography picture_from_plane;
  std::vector<bool> tag_is_inlier;
};

// RANSAC (Fischler & Bolles 1981) over corners, least squares on the inliers. A tag is an inlier when all of its four
// corners lie within `threshold`, in the picture's units. The seed is fixed: the same tags give the same result.
// Nothing when no homography explains at least one tag.
[[nodiscard]] std::optional<RobustHomography> robust_homography(std::span<const TagInPlane>, double threshold);

}  // namespace mf
