// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/frame.h"
#include "common/image.h"

namespace mf {

// Linear mosaic → three channels (mono and RGB pass through unchanged). Malvar, He, Cutler 2004: bilinear with a
// gradient correction, on linear data; results below zero are set to zero (radiance).
[[nodiscard]] ImageF demosaic(const ImageF& mosaic, PixelLayout);

// Each 2×2 cell → one pixel, the greens averaged (mono: box filter): half the size, no interpolation across cells.
[[nodiscard]] ImageF bin_cells(const ImageF& mosaic, PixelLayout);

}  // namespace mf
