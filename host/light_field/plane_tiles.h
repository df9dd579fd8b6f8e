// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "host/light_field/rectified_views.h"
#include "host/light_field/view_ranking.h"

namespace mf {

// Fills tiles of a light field whose proxy is the plane itself, from rectified views: weighted sums, no projection. The
// views that could speak are ranked once a block, the weights are exact at every texel. One a thread: it
// holds the working memory.
class PlaneTiles {
 public:
  // Keeps references to both; `field` has everything but its texels.
  PlaneTiles(const RectifiedViews&, const LightField& field, int k);

  // Precondition: `tile` holds resolution² texels.
  void fill(std::size_t direction, Eigen::Vector4f* tile);

 private:
  void find_candidates(const RectifiedViews::Block&);
  void blend(int block_x, int block_y, Lanes3& colour, Lanes& confidence);

  const RectifiedViews& views_;
  const LightField& field_;
  int k_;
  Eigen::Vector3f direction_;  // world

  std::vector<float> bounds_;
  LeastPenalties ranking_;
  std::vector<ViewPenalty> least_;
  std::vector<std::size_t> candidates_;  // slots of the block at hand
  std::vector<Lanes> penalties_, weights_;
};

// Copies a block's lanes into a tile of n² texels, as far as it reaches.
void store_block(const Lanes3& colour, const Lanes& confidence, int block_x, int block_y, int n, Eigen::Vector4f* tile);

}  // namespace mf
