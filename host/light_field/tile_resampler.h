// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "host/blending/ray_penalty.h"
#include "host/light_field/block_blend.h"
#include "host/light_field/cell_in_view.h"
#include "host/light_field/emitter_blender.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/proxy_visibility.h"
#include "host/light_field/rectified_views.h"
#include "host/light_field/view_ranking.h"
#include "host/light_field/view_rays.h"
#include "host/light_field/view_sieve.h"

namespace mf {

// Fills a light field's tiles, one direction at a time; for any proxy but the plane (plane_tiles.h).
//
// What varies slowly over the plane is computed on a sparse grid of vertices and interpolated (Buehler's blending
// field): which views could speak for a ray is decided at every second vertex by ranking all that look that way; what a
// view saw of the direction's cell is fetched at every vertex. The penalties, and so the weights, are exact at every
// texel. Where the proxy's distance jumps nothing is interpolated, and where what was seen bends it is fetched anew for
// every texel. One resampler a thread: it holds the working memory.
class TileResampler {
 public:
  // Keeps references to all; `field` has everything but its texels. A direction's cell is fetched in 6 · 2^cell_splits
  // parts; 0 or 1.
  TileResampler(const std::vector<FieldView>& views, const LightField& field, const ProxyVisibility&,
                const EmitterBlender&, const PenaltyOptions&, int cell_splits = 1);

  // Precondition: `tile` holds resolution² texels.
  void fill(std::size_t direction, Eigen::Vector4f* tile);

 private:
  // What one direction's tile needs again and again.
  struct Cell {
    Eigen::Vector3f direction;           // world
    std::vector<CellSample> parts;       // directions in the world
    std::vector<CellSample> fine_parts;  // the same, finer, for cells near emitters; else empty
    float angle_rad = 0;                 // side of a square of the cell's solid angle
    float part_angle_rad = 0;
  };
  struct Vertex {
    Eigen::Vector3f p;  // world
    ProxyPoint focus;
  };
  // The views that may see some of what the direction's rays meet.
  struct Lookers {
    std::vector<std::uint32_t> views;
    std::vector<float> centre_x, centre_y, centre_z;
  };
  // Where a view shows a point.
  struct Look {
    static constexpr int nowhere = -1;
    float u = 0, v = 0;  // pixels of level 0
    int level = nowhere;
  };
  struct Seen {
    Eigen::Vector4f colour;  // premultiplied; weight
    std::uint32_t stamp = 0;
  };
  struct LookersCell {
    CellInView cell;
    std::uint32_t tile = 0;  // for which it was made
  };
  // What a block's texels are blended at.
  struct Rays {
    Lanes3 p;
    Lanes4 focus;
  };

  void prepare(std::size_t direction);
  void find_lookers();
  void rank_views(int corner_x, int corner_y);
  void gather_candidates(int block_x, int block_y);
  void blend(int block_x, int block_y, Lanes3& colour, Lanes& confidence);
  [[nodiscard]] bool is_rough(int block_x, int block_y) const;
  void interpolated_rays(int block_x, int block_y, Rays&) const;
  void traced_rays(int block_x, int block_y, Rays&) const;
  void see_vertices(int block_x, int block_y);
  [[nodiscard]] bool is_smooth() const;
  void blend_patches(const Rays&, Lanes3& colour, Lanes& confidence);
  void blend_texels(const Rays&, Lanes3& colour, Lanes& confidence);
  void dim_hidden(std::uint32_t view, const Lanes4& focus, Lanes3& seen, Lanes& weight) const;
  [[nodiscard]] const Eigen::Vector4f& seen_at(std::size_t looker, int vertex_x, int vertex_y);
  [[nodiscard]] const CellInView& cell_of(std::size_t looker);

  [[nodiscard]] bool near_emitter(int block_x, int block_y) const;
  [[nodiscard]] Eigen::Vector4f mean_near_emitter(const Eigen::Vector3f& p) const;
  void blend_near_emitter(int block_x, int block_y, Lanes3& colour, Lanes& confidence);

  // The octaves by which a view sees the cell too coarsely; 0 when they do not count.
  [[nodiscard]] float coarseness_of(const FieldView&, const ProxyPoint&) const;
  void penalize(const FieldView&, const Lanes3& p, const Lanes4& focus, const Lanes& weight, Lanes& penalty) const;
  [[nodiscard]] const Vertex& vertex(int x, int y) const {
    return vertex_[static_cast<std::size_t>(y * vertices_ + x)];
  }

  const std::vector<FieldView>& views_;
  const LightField& field_;
  const ProxyVisibility& visibility_;
  const EmitterBlender& emitters_;
  ViewSieve sieve_;
  TexelGrid grid_;
  PenaltyOptions penalty_;
  int cell_splits_;
  int blocks_;    // along a side
  int vertices_;  // along a side

  Cell cell_;
  std::vector<Vertex> vertex_;
  Lookers lookers_;
  std::vector<float> bounds_;
  std::vector<Look> looks_;  // by looker, of those whose penalty is asked for
  ViewRanking ranking_;
  std::vector<std::vector<std::uint32_t>> best_lookers_;  // by block corner
  std::vector<float> reach_m_;                            // by block corner: how far the farthest of them pass
  std::vector<std::uint32_t> candidates_;                 // lookers, of the block at hand
  std::vector<std::uint32_t> candidate_views_;            // the same, as views
  std::vector<std::uint32_t> mark_;                       // by looker: the block that listed it last
  std::uint32_t block_count_ = 0;
  std::vector<Seen> seen_;  // by looker, then three rows of vertices: blocks share their edges
  std::uint32_t row_count_ = 0;
  std::vector<LookersCell> cells_;  // by looker
  std::uint32_t tile_count_ = 0;
  std::vector<Patch<Eigen::Vector4f>> patches_;  // by candidate
  std::vector<Lanes3> seen_lanes_;               // by candidate, where texels are seen one by one
  std::vector<Lanes> distances_, penalties_, weights_;
};

}  // namespace mf
