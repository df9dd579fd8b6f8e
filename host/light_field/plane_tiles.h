// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

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
    Eigen::Vector3f direction;            // world
    Eigen::Matrix3f from_world;           // into a frame whose third axis is the direction
    std::vector<float> least_thresholds;  // inverse, by block: few views that matter there fall below
  };
  void find_thresholds(std::span<const std::size_t> directions);
  [[nodiscard]] float inverse_threshold_at(const RectifiedViews::Vertex&, const Eigen::Vector3f& direction);
  void find_candidates(const RectifiedViews::Block&, const Eigen::Vector3f& direction, float least_threshold);
  void blend(const Wanted&, int block_x, int block_y, Lanes3& colour, Lanes& confidence);

  const RectifiedViews& views_;
  const LightField& field_;
  std::size_t k_;
  std::vector<Wanted> wanted_;

  std::vector<float> bounds_;
  LeastPenalties ranking_;
  std::vector<std::uint32_t> candidates_;  // slots of the block at hand
  std::vector<Lanes> inverse_penalties_, sinking_;
};

// Copies a block's lanes into a tile of n² texels, as far as it reaches.
void store_block(const Lanes3& colour, const Lanes& confidence, int block_x, int block_y, int n, Eigen::Vector4f* tile);

}  // namespace mf
