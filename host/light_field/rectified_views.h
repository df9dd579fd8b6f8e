// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "host/light_field/block_blend.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/plane_blend.h"

namespace mf {

// World points of a field's texels and blocks.
struct TexelGrid {
  Eigen::Vector3f origin;  // of the texel corner (0, 0): the rectangle's (min x, max y)
  Eigen::Vector3f step_x, step_y;

  TexelGrid(const PlaneRectangle&, int resolution);
  // Texel centres at +0.5.
  [[nodiscard]] Eigen::Vector3f at(float x, float y) const { return origin + x * step_x + y * step_y; }
};

// All views warped onto the plane, once for all directions: with the plane as proxy a texel is the same pixel of a view
// whatever the direction (Ihrke et al. 2008, §4.3).
class RectifiedViews {
 public:
  RectifiedViews(const std::vector<FieldView>&, const PlaneRectangle&, int resolution);

  // What the views that see some of it show of a block, in unit(view): for each four quarters (plane_blend.h).
  struct Block {
    std::vector<std::uint32_t> views;        // rising
    std::vector<float> ray_x, ray_y, ray_z;  // of each through the block's middle, unit
    std::vector<float> spread_rad;           // how far its rays through the block turn from that one
    std::vector<float> most;                 // its weight where it is largest
    std::vector<std::uint16_t> halves;

    [[nodiscard]] const std::uint16_t* shown(std::size_t slot, std::size_t quarter) const {
      return halves.data() + (slot * quarters + quarter) * quarter_halves;
    }
  };
  // The views that see a point where blocks meet.
  struct Vertex {
    std::vector<float> ray_x, ray_y, ray_z;  // unit
    std::vector<float> weight, factor;       // 1 / weight²
  };
  [[nodiscard]] int blocks() const { return blocks_; }  // along a side
  [[nodiscard]] const Block& block(int x, int y) const { return block_[static_cast<std::size_t>(y * blocks_ + x)]; }
  // Where blocks meet: blocks() + 1 along a side.
  [[nodiscard]] const Vertex& vertex(int x, int y) const {
    return vertex_[static_cast<std::size_t>(y * (blocks_ + 1) + x)];
  }
  [[nodiscard]] const Eigen::Vector3f& centre(std::uint32_t view) const { return centre_[view]; }
  [[nodiscard]] float unit(std::uint32_t view) const { return unit_[view]; }
  [[nodiscard]] const TexelGrid& grid() const { return grid_; }

 private:
  void rectify(const std::vector<FieldView>&, int block_x, int block_y);
  void look_at_vertex(const std::vector<FieldView>&, int x, int y);

  TexelGrid grid_;
  float texel_m_;
  int blocks_;
  std::vector<Block> block_;
  std::vector<Vertex> vertex_;
  std::vector<Eigen::Vector3f> centre_;
  std::vector<float> unit_;
};

}  // namespace mf
