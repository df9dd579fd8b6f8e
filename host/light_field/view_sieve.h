// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/light_field/field_views.h"
#include "host/light_field/view_rays.h"

namespace mf {

// Tells which of many views may show a point: of thousands a few dozen do, and looking into the others is most of the
// work of a sweep. All views are projected at once, in loops that the compiler vectorizes.
class ViewSieve {
 public:
  explicit ViewSieve(const std::vector<FieldView>&);

  // Indices of the views, rising, on whose picture a patch of `angle_rad` about the point may fall; all others show
  // nothing of it at level_for_angle(). `found` is overwritten.
  void find(const ProxyPoint&, float angle_rad, std::vector<std::uint32_t>& found) const;

  // The same for all that a few proxy points enclose: views on whose picture the box about them falls, widened by
  // `margin` of its size for what bulges between them.
  void find(std::span<const ProxyPoint>, float margin, float angle_rad, std::vector<std::uint32_t>& found) const;

 private:
  std::vector<std::vector<float>> pixel_from_world_;  // the matrix's 12 elements by rows, each for all views
  std::vector<float> width_, height_, focal_px_;
};

}  // namespace mf
