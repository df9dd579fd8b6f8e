// SPDX-License-Identifier: Apache-2.0
#include "common/mirror_picture.h"

#include <cmath>

namespace mf {

CameraModel flipped_camera(const CameraModel& camera) {
  CameraModel flipped = camera;
  flipped.parameters[2] = camera.width - camera.cx();
  flipped.parameters[7] = -camera.parameters[7];
  return flipped;
}

ImageU8 mask_of(const Polygon2& polygon, int width, int height) {
  ImageU8 mask(width, height, 1);
  for (int y = 0; y < height; ++y) {
    std::vector<double> crossings;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d& a = polygon[i];
      const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
      if ((a.y() <= y + 0.5) != (b.y() <= y + 0.5))
        crossings.push_back(a.x() + (y + 0.5 - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
    std::sort(crossings.begin(), crossings.end());
    for (std::size_t i = 0; i + 1 < crossings.size(); i += 2)
      for (int x = std::max(0, static_cast<int>(std::ceil(crossings[i] - 0.5)));
           x < width && x + 0.5 < crossings[i + 1]; ++x)
        mask.at(x, y) = 255;
  }
  return mask;
}

}  // namespace mf
