// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "host/blending/ray_penalty.h"
#include "host/light_field/emitter_blender.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/proxy_visibility.h"

namespace mf {

// Which frames lit which texels. Who speaks changes slowly over the plane, so one answer stands for a block of
// `block_texels`² texels: that of the texel at its middle. Size: directions × (resolution / 16)² × k answers.
struct Provenance {
  static constexpr int block_texels = 16;
  static constexpr std::uint32_t nobody = 0xFFFFFFFF;

  struct Share {
    std::uint32_t frame = nobody;  // index in `frames`
    float weight = 0;              // of the k of a block they sum to 1, or to 0 where no view looked
  };

  int side = 0;                     // blocks along a tile
  int k = 0;                        // shares a block, heaviest first
  std::vector<std::string> frames;  // every mirror frame of the session, by name, used or not
  std::vector<Share> shares;        // by direction, block row (max y first), block column, rank
  // By direction, block row, column: 0, or 1 + the index of the emitter near whose light the block's cell lies. There
  // the emitter's outline and mask, which all views drew together, come before these shares.
  std::vector<std::uint32_t> emitter;

  [[nodiscard]] std::size_t block(std::size_t direction, int x, int y) const {
    const auto n = static_cast<std::size_t>(side);
    return (direction * n + static_cast<std::size_t>(y)) * n + static_cast<std::size_t>(x);
  }
  [[nodiscard]] std::span<const Share> of_block(std::size_t index) const {
    return {shares.data() + index * static_cast<std::size_t>(k), static_cast<std::size_t>(k)};
  }
  // Of the block that holds a point of the plane (plane frame, metres; outside the rectangle: the nearest).
  [[nodiscard]] std::size_t block_at(const PlaneRectangle&, int resolution, std::size_t direction,
                                     const Eigen::Vector2f& p_in_plane) const;
};

// `field` has everything but its texels. `frame_names`: of the calibration, which FieldView::frame indexes.
[[nodiscard]] Provenance trace_provenance(const std::vector<FieldView>&, const LightField& field,
                                          const ProxyVisibility&, const EmitterBlender&, const PenaltyOptions&,
                                          std::vector<std::string> frame_names);

// An EXR with a row a direction and a pixel a block (docs/light_field.md, "Provenance"). Written aside and renamed.
// Both throw InputError naming the file.
void write_provenance(const std::filesystem::path&, const Provenance&);
[[nodiscard]] Provenance read_provenance(const std::filesystem::path&);

}  // namespace mf
