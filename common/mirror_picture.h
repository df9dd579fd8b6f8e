// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "common/camera_model.h"
#include "common/image.h"
#include "common/virtual_view.h"

namespace mf {

// A frame of the mirror as the picture of an ordinary camera behind it: flipped left to right.
//
//   view_from_cam = diag(−1, 1, 1) · S,   c_x → W − c_x,   p₂ → −p₂
//
// S is the reflection of VirtualView, whose view_from_cam is this pose already. This is the camera's part.
[[nodiscard]] CameraModel flipped_camera(const CameraModel&);

template <typename T>
void flip_x(Image<T>& image) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width / 2; ++x)
      for (int c = 0; c < image.channels; ++c) std::swap(image.at(x, y, c), image.at(image.width - 1 - x, y, c));
}

// 255 where a pixel's centre is inside the polygon (even-odd rule), else 0.
[[nodiscard]] ImageU8 mask_of(const Polygon2&, int width, int height);

}  // namespace mf
