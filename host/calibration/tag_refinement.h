// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/frame.h"
#include "common/image.h"
#include "common/tag_pattern.h"

namespace mf {

using TagCorners = std::array<Eigen::Vector2d, 4>;  // pixels, in the order of PlanarTag::corners_m()

// A tag's corners as the picture of the whole tag tells them, and how well.
struct RefinedTag {
  TagCorners corners_px;
  // Inverse covariance of (x0 y0 x1 y1 x2 y2 x3 y3), px⁻²; blur and light are marginalized out.
  Eigen::Matrix<double, 8, 8> information;
  double blur_px = 0;      // standard deviation of lens and pixel together
  double correlation = 0;  // of picture and model, 0 to 1
  double right_cells = 0;  // fraction of the printed cells that the picture confirms, 0 to 1
};

struct TagRefinementOptions {
  int max_iterations = 30;
  double initial_blur_px = 0.7;
  double max_shift_cells = 1;  // a corner that moves further, in cells of the tag, has left its tag
};

// Direct alignment of the printed pattern with the **linear** picture (Lucas & Kanade 1981, inverse problem by
// Gauss–Newton): over the tag's own homography h, the blur σ, and the light
//
//   I(p) = o_c + a_c · (T ⊛ Gσ)(h⁻¹ p) · (1 + g · (u, v)),      c the colour of pixel p
//
// so a Bayer mosaic is used as it is, each pixel with its own channel's gain, and light that varies over the tag does
// not pull its edges. Noise is estimated from the residuals, in the dark and in the bright separately; a hard shadow or
// an occluder is bounded by a robust weight. Every edge inside the tag speaks, not only its border.
//
// `picture`: one channel, linear; a mosaic of `layout` or mono. `start`: within about half a cell.
// Nothing when the alignment fails: outside the picture, no contrast, not converged, moved too far.
[[nodiscard]] std::optional<RefinedTag> refine_tag(const ImageF& picture, PixelLayout layout, const TagPattern&,
                                                   const TagCorners& start, const TagRefinementOptions& = {});

}  // namespace mf
