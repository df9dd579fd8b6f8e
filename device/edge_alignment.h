// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/image.h"

namespace mf {

using QuadCorners = std::array<Eigen::Vector2d, 4>;

// A dark square's corners from its four sides in a **linear** picture, and where these cross. AprilTag does so on its
// eight bits (Wang & Olson 2016), which are stretched to find tags and so shift edges.
//
// A side is a straight step from dark to bright through a blur, fitted to every pixel near it by least squares that are
// weighted for shot noise: place, direction, the blur's width, and the levels of both sides with their slopes along it.
// So a pixel's noise counts by as much as the pixel knows of the edge. (The centre of squared slopes, which is less to
// compute, is pulled by noise far from the edge, most of all in mono frames, which no filter smooths.)
//
// `start`: in the order of TagDetection::corners_px, within `reach_px` of the edges. `reach_px`: how far to both sides
// to look, 1 or more, less than the white border and the dark one are wide. Nothing when an edge cannot be seen or the
// corners move by more than twice the reach.
[[nodiscard]] std::optional<QuadCorners> align_edges(const ImageF& linear, const QuadCorners& start, double reach_px);

}  // namespace mf
