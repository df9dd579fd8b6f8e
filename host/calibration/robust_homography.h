// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "common/homography.h"
#include "host/calibration/target_view.h"

namespace mf {

struct RobustHomography {
  Homography picture_from_plane;  // (x, y) of the target's plane z = const, metres → pixels
  std::vector<bool> tag_is_inlier;
};

// RANSAC (Fischler & Bolles 1981) over corners, least squares on the inliers. A tag is an inlier when all of its four
// corners lie within `threshold_px`. The seed is fixed: the same tags give the same result.
// Precondition: the tags lie in one plane of constant z. Nothing when no homography explains at least one tag.
[[nodiscard]] std::optional<RobustHomography> robust_homography(const std::vector<TagSighting>&, double threshold_px);

}  // namespace mf
