// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/image.h"

namespace mf {

using QuadCorners = std::array<Eigen::Vector2d, 4>;

// A dark square's corners from its four edges in a **linear** picture: along each edge, the place where the light
// changes (the centre of the squared slope across it), a line through these places, and where the lines cross. What
// AprilTag does on its eight bits (Wang & Olson 2016), which are stretched to find tags and so shift edges.
//
// `start`: in the order of TagDetection::corners_px, within `reach_px` of the edges. `reach_px`: how far to both sides
// to look, less than the white border and the dark one are wide. Nothing when an edge cannot be seen or the corners
// move by more than twice the reach.
[[nodiscard]] std::optional<QuadCorners> align_edges(const ImageF& linear, const QuadCorners& start, double reach_px);

}  // namespace mf
