// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "host/light_field/plane_blend.h"
#include "host/light_field/rectified_views.h"
#include "host/light_field/view_ranking.h"

namespace mf {

// Fills tiles of a light field whose proxy is the plane itself, from rectified views: weighted sums, no projection.
// Exact but for the choice of a block's views: those that exceed a bound of the adaptive threshold (view_weights.h),
// which is found where blocks meet, at the vertices of a grid, by ranking all views there. One a thread: it holds the
// working memory.
class PlaneTiles {
 public:
  // Keeps references to both; `field` has everything but its texels.
  PlaneTiles(const RectifiedViews&, const LightField& field, int k);

  // Several directions at once, best neighbours: what views show of a block is then at hand for all of them.
  // Precondition: `tiles` holds resolution² texels for each.
  void fill(std::span<const std::size_t> directions, Eigen::Vector4f* tiles);

 private:
  struct Wanted {
    Eigen::Vector3f direction;      // world
    std::vector<float> thresholds;  // inverse, at the vertices, by rows
  };
  void find_thresholds(std::span<const std::size_t> directions);
  [[nodiscard]] float inverse_threshold_at(const RectifiedViews::Vertex&, const Eigen::Vector3f& direction);
  [[nodiscard]] float least_threshold(const Wanted&, int block_x, int block_y) const;
  void begin_block(int block_x, int block_y);
  void find_candidates(const Eigen::Vector3f& direction, float least_threshold);
  void look_up(std::size_t slot);
  void blend_quarter(const Wanted&, std::size_t quarter, float least_threshold, BlendedQuarter&);

  const RectifiedViews& views_;
  const LightField& field_;
  std::size_t k_;
  std::vector<Wanted> wanted_;

  std::vector<float> bounds_;
  ViewRanking ranking_;
  // Of the block at hand:
  const RectifiedViews::Block* block_ = nullptr;
  Eigen::Vector3f corner_;                 // the centre of its first texel
  std::vector<std::uint32_t> candidates_;  // slots, looked up
  std::vector<std::uint32_t> looked_up_;   // by slot: which of rays_ are its own, from 1; 0: none yet
  std::vector<QuarterRays> rays_;          // four quarters each
  std::vector<QuarterView> speakers_;
  std::vector<Quarter> inverse_penalties_;
};

}  // namespace mf
