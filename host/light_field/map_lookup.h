// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "common/image.h"

namespace mf {

// Bilinear in a map of one channel. x, y: texels, whose centres are at +0.5; beyond the map its rim's value holds on.
[[nodiscard]] inline float bilinear(const ImageF& map, float x, float y) {
  const float u = std::clamp(x - 0.5F, 0.0F, static_cast<float>(map.width - 1));
  const float v = std::clamp(y - 0.5F, 0.0F, static_cast<float>(map.height - 1));
  const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
  const int x1 = std::min(x0 + 1, map.width - 1), y1 = std::min(y0 + 1, map.height - 1);
  const float fx = u - static_cast<float>(x0), fy = v - static_cast<float>(y0);
  return (map.at(x0, y0) * (1 - fx) + map.at(x1, y0) * fx) * (1 - fy) +
         (map.at(x0, y1) * (1 - fx) + map.at(x1, y1) * fx) * fy;
}

}  // namespace mf
