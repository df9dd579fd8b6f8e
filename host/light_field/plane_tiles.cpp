// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/plane_tiles.h"

#include <algorithm>

namespace mf {

namespace {

constexpr std::size_t spare_on_plane =
    4;  // ranked beyond k, so that the k best of any texel are among its corners' lists
constexpr float same_ray_on_plane = 1e-4F;  // rays closer than this are the same

}  // namespace

void store_block(const Lanes3& colour, const Lanes& confidence, int block_x, int block_y, int n,
                 Eigen::Vector4f* tile) {
  const int columns = std::min(block_side, n - block_x * block_side),
            rows = std::min(block_side, n - block_y * block_side);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const std::size_t lane = static_cast<std::size_t>(y * block_side + x);
      tile[(block_y * block_side + y) * n + block_x * block_side + x] = {colour.x.v[lane], colour.y.v[lane],
                                                                         colour.z.v[lane], confidence.v[lane]};
    }
}

PlaneTiles::PlaneTiles(const RectifiedViews& views, const LightField& field, int k)
    : views_(views),
      field_(field),
      k_(k),
      best_views_(static_cast<std::size_t>((views.blocks() + 1) * (views.blocks() + 1))) {}

void PlaneTiles::fill(std::size_t direction, Eigen::Vector4f* tile) {
  direction_ = field_.plane.world_from_plane.rotation.cast<float>() * field_.directions.directions[direction];
  const int blocks = views_.blocks();
  for (int y = 0; y <= blocks; ++y)
    for (int x = 0; x <= blocks; ++x) rank_views(x, y);
  for (int y = 0; y < blocks; ++y)
    for (int x = 0; x < blocks; ++x) {
      gather_candidates(x, y);
      Lanes3 colour{};
      Lanes confidence{};
      blend(x, y, colour, confidence);
      store_block(colour, confidence, x, y, field_.resolution, tile);
    }
}

void PlaneTiles::rank_views(int corner_x, int corner_y) {
  const RectifiedViews::Corner& corner = views_.corner(corner_x, corner_y);
  const std::size_t count = corner.views.size();
  bounds_.resize(std::max(bounds_.size(), count));
  squared_chords(direction_, corner.ray_x.data(), corner.ray_y.data(), corner.ray_z.data(), corner.factor.data(), count,
                 bounds_.data());
  auto& best = best_views_[static_cast<std::size_t>(corner_y * (views_.blocks() + 1) + corner_x)];
  best.clear();
  for (const ViewPenalty& v : ranking_.find(bounds_.data(), count, static_cast<std::size_t>(k_) + spare_on_plane,
                                            [&](std::size_t i) { return bounds_[i]; }))
    best.push_back(corner.views[v.view]);
}

// The views that any corner of a block ranked among its best, each once, as slots of the block.
void PlaneTiles::gather_candidates(int bx, int by) {
  const RectifiedViews::Block& block = views_.block(bx, by);
  ++block_count_;
  candidates_.clear();
  for (int corner = 0; corner < 4; ++corner)
    for (const std::uint32_t view :
         best_views_[static_cast<std::size_t>((by + corner / 2) * (views_.blocks() + 1) + bx + corner % 2)]) {
      if (mark_.size() <= view) mark_.resize(view + 1, 0);
      if (mark_[view] == block_count_) continue;
      mark_[view] = block_count_;
      const auto at = std::lower_bound(block.views.begin(), block.views.end(), view);
      if (at != block.views.end() && *at == view)
        candidates_.push_back(static_cast<std::size_t>(at - block.views.begin()));
    }
  std::sort(candidates_.begin(), candidates_.end());  // sums in one order, however they were found
}

void PlaneTiles::blend(int bx, int by, Lanes3& colour, Lanes& confidence) {
  const RectifiedViews::Block& block = views_.block(bx, by);
  const TexelGrid& grid = views_.grid();
  Lanes3 p;
  set_points(grid.at(static_cast<float>(bx * block_side) + 0.5F, static_cast<float>(by * block_side) + 0.5F),
             grid.step_x, grid.step_y, p);
  penalties_.resize(candidates_.size());
  weights_.resize(candidates_.size());
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    decode_weights(block.weights(candidates_[c]), weights_[c]);
    angle_penalties(p, direction_, views_.centre(block.views[candidates_[c]]), weights_[c], penalties_[c]);
  }
  weights_of(penalties_, weights_, k_, same_ray_on_plane, confidence);
  for (std::size_t c = 0; c < candidates_.size(); ++c)
    add_colours(block.colours(candidates_[c]), views_.unit(block.views[candidates_[c]]), penalties_[c], colour);
}

}  // namespace mf
