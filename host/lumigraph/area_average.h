// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/image.h"

namespace mf {

// A picture made smaller: each pixel is the mean of the source over the area that it covers. Any size up to the
// source's.
[[nodiscard]] ImageU8 area_average(const ImageU8&, int width, int height);
[[nodiscard]] ImageF area_average(const ImageF&, int width, int height);

}  // namespace mf
