// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/view_rays.h"

#include <algorithm>
#include <cmath>

namespace mf {

int level_for_angle(const FieldView& view, const ProxyPoint& x, float angle_rad) {
  // Scaled as proxy_point() makes it, X lies at distance 1/s from p, so the same patch seen from C subtends angle /
  // |ray|.
  const float pixels = angle_rad / ray_to(x, view.centre_in_world).norm() * view.focal_px;
  const int level = pixels > 1 ? std::ilogb(pixels) : 0;
  return std::clamp(level, 0, static_cast<int>(view.levels.size()) - 1);
}

}  // namespace mf
