// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "host/blending/ray_penalty.h"
#include "host/blending/view_weights.h"
#include "host/light_field/emitter_blender.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/view_rays.h"

namespace mf {

// Fills a light field's tiles, one direction at a time.
//
// What varies slowly over the plane is computed on a sparse grid of vertices and interpolated (Buehler's blending
// field): which views could speak for a ray is decided at every second vertex by ranking all of them; what a view saw
// of the direction's cell is fetched at every vertex. The penalties, and so the weights, are exact at every texel. One
// resampler a thread: it holds the working memory.
class TileResampler {
 public:
  // Keeps references to all; `field` has everything but its texels.
  TileResampler(const std::vector<FieldView>& views, const LightField& field, const EmitterBlender& emitters,
                const PenaltyOptions&);

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

  void prepare(std::size_t direction);
  void rank_views(int vertex_x, int vertex_y);
  void gather_candidates(int block_x, int block_y);
  void fetch_candidates(int block_x, int block_y);
  [[nodiscard]] Eigen::Vector4f blend(int x, int y);
  [[nodiscard]] bool near_emitter(int block_x, int block_y) const;
  [[nodiscard]] Eigen::Vector4f mean_near_emitter(const Eigen::Vector3f& p, float part_angle) const;
  void fill_near_emitter(int block_x, int block_y, Eigen::Vector4f* tile);

  [[nodiscard]] Eigen::Vector3f point(float texel_x, float texel_y) const;
  [[nodiscard]] ProxyPoint focus(const Eigen::Vector3f& p) const;
  [[nodiscard]] float penalty(const FieldView&, const Eigen::Vector3f& p, const ProxyPoint&, float weight) const;
  [[nodiscard]] Eigen::Vector4f fetch_cell(const FieldView&, const Vertex&) const;

  const std::vector<FieldView>& views_;
  const LightField& field_;
  const EmitterBlender& emitters_;
  PenaltyOptions penalty_;
  int blocks_;    // along a side
  int vertices_;  // along a side

  Cell cell_;
  std::vector<Vertex> vertex_;
  std::vector<std::vector<std::uint32_t>> best_views_;  // by block corner
  std::vector<std::uint32_t> candidates_;               // views, of the block at hand
  std::vector<Eigen::Vector4f> seen_;                   // by candidate, then vertex of the block: premultiplied
  std::vector<std::uint32_t> mark_;                     // by view: the block that listed it last
  std::uint32_t block_count_ = 0;
  std::vector<ViewPenalty> ranked_;
  std::vector<ViewWeight> weights_;
  std::vector<Eigen::Vector4f> seen_here_;  // by candidate, at the texel at hand
  int block_x_ = 0, block_y_ = 0;
};

}  // namespace mf
