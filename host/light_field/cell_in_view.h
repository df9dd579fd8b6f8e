// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include "host/light_field/block_blend.h"
#include "host/light_field/direction_set.h"
#include "host/light_field/field_views.h"
#include "host/light_field/view_rays.h"

namespace mf {

// How one view sees the parts of a direction's cell: as offsets from the cell's direction, which are the same for every
// point of the plane.
//
//   pixel of a part = pixel_from_world · X + offset,   X the proxy point of (p, ω), homogeneous
class CellInView {
 public:
  static constexpr std::size_t most_parts = 16;

  CellInView() = default;
  // `direction` and the parts' in the world. Precondition: no more than 16 parts.
  CellInView(const FieldView&, const Eigen::Vector3f& direction, std::span<const CellSample> parts);

  // Mean over the parts of what the view saw: premultiplied colour and weight. Each is looked up at the level whose
  // texels are as large as a part.
  [[nodiscard]] Eigen::Vector4f seen(const FieldView&, const ProxyPoint&) const;
  // The same at every texel of a block where `needed` is not 0; others are left as they are.
  void seen(const FieldView&, const Lanes4& proxy_point, const Lanes& needed, Lanes3& colour, Lanes& weight) const;

 private:
  struct alignas(32) Floats {
    std::array<float, most_parts> v{};
  };
  Floats x_, y_, z_;  // offsets, pixels times depth
  Floats share_;      // of the cell's solid angle
  std::size_t parts_ = 0;
  float part_angle_rad_ = 0;
};

}  // namespace mf
