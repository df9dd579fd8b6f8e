// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/frame.h"
#include "common/image.h"
#include "common/response_curve.h"

namespace mf {

// A rectangle of pixels: x0 … x1 − 1, y0 … y1 − 1.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  [[nodiscard]] bool empty() const { return x1 <= x0 || y1 <= y0; }
  [[nodiscard]] int width() const { return x1 - x0; }
  [[nodiscard]] int height() const { return y1 - y0; }
};

// Radiance in a box of the frame's 2 × 2 cells (box and result in cells, one or three channels): what bin_cells() makes
// of linearize(), in one pass over the box alone. Vignetting is that at a cell's centre. Precondition: the box lies
// inside.
[[nodiscard]] ImageF binned_radiance(const Frame&, const PixelFormat&, const ResponseCurve&, const PixelBox&);

}  // namespace mf
