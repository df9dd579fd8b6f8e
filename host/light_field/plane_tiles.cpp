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
    : views_(views), field_(field), k_(k) {}

void PlaneTiles::fill(std::size_t direction, Eigen::Vector4f* tile) {
  direction_ = field_.plane.world_from_plane.rotation.cast<float>() * field_.directions.directions[direction];
  for (int y = 0; y < views_.blocks(); ++y)
    for (int x = 0; x < views_.blocks(); ++x) {
      find_candidates(views_.block(x, y));
      Lanes3 colour{};
      Lanes confidence{};
      blend(x, y, colour, confidence);
      store_block(colour, confidence, x, y, field_.resolution, tile);
    }
}

// The views whose rays through the block's middle lie nearest to the direction, each as if its weight were everywhere
// what it is at most in the block.
void PlaneTiles::find_candidates(const RectifiedViews::Block& block) {
  const std::size_t count = block.views.size();
  bounds_.resize(std::max(bounds_.size(), count));
  squared_chords(direction_, block.ray_x.data(), block.ray_y.data(), block.ray_z.data(), block.factor.data(), count,
                 bounds_.data());
  least_ = ranking_.find(bounds_.data(), count, 2 * static_cast<std::size_t>(k_) + spare_on_plane,
                         [&](std::size_t i) { return bounds_[i]; });
  std::sort(least_.begin(), least_.end(), ranks_before);  // sums in one order, and the best views first
  candidates_.clear();
  for (const ViewPenalty& v : least_) candidates_.push_back(v.view);
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
