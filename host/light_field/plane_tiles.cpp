// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/plane_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/light_field/plane_blend.h"

namespace mf {

namespace {

constexpr float slack = 0.95F;  // between the vertices a threshold may be less than at any of them

// Copies a quarter of a block into a tile of n² texels, as far as it reaches.
void store(const BlendedQuarter& from, std::size_t quarter, int block_x, int block_y, int n, Eigen::Vector4f* tile) {
  for (std::size_t i = 0; i < quarter_lanes; ++i) {
    const auto [x, y] = texel_of(quarter, i);
    const int column = block_x * block_side + x, row = block_y * block_side + y;
    if (column < n && row < n)
      tile[row * n + column] = {from.red.v[i], from.green.v[i], from.blue.v[i], from.confidence.v[i]};
  }
}

}  // namespace

PlaneTiles::PlaneTiles(const RectifiedViews& views, const LightField& field, int k)
    : views_(views), field_(field), k_(static_cast<std::size_t>(k)) {}

void PlaneTiles::fill(std::span<const std::size_t> directions, Eigen::Vector4f* tiles) {
  find_thresholds(directions);
  const std::size_t texels = field_.texel_count();
  for (int y = 0; y < views_.blocks(); ++y)
    for (int x = 0; x < views_.blocks(); ++x) {
      begin_block(x, y);
      for (std::size_t i = 0; i < directions.size(); ++i) {
        const float least = least_threshold(wanted_[i], x, y);
        find_candidates(wanted_[i].direction, least);
        for (std::size_t q = 0; q < quarters; ++q) {
          BlendedQuarter blended;
          blend_quarter(wanted_[i], q, least, blended);
          store(blended, q, x, y, field_.resolution, tiles + i * texels);
        }
      }
    }
}

void PlaneTiles::find_thresholds(std::span<const std::size_t> directions) {
  const Eigen::Matrix3f turn = field_.plane.world_from_plane.rotation.cast<float>().toRotationMatrix();
  wanted_.resize(directions.size());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    wanted_[i].direction = turn * field_.directions.directions[directions[i]];
    wanted_[i].thresholds.clear();
  }
  for (int y = 0; y <= views_.blocks(); ++y)
    for (int x = 0; x <= views_.blocks(); ++x)
      for (Wanted& w : wanted_) w.thresholds.push_back(inverse_threshold_at(views_.vertex(x, y), w.direction));
}

float PlaneTiles::inverse_threshold_at(const RectifiedViews::Vertex& vertex, const Eigen::Vector3f& direction) {
  const std::size_t count = vertex.weight.size();
  if (count <= k_) return 0;
  bounds_.resize(std::max(bounds_.size(), count));
  squared_chords(direction, vertex.ray_x.data(), vertex.ray_y.data(), vertex.ray_z.data(), vertex.factor.data(), count,
                 bounds_.data());
  const std::vector<ViewPenalty>& least = ranking_.find(
      bounds_.data(), count, k_ + 1, [&](std::size_t i) { return bounds_[i]; }, [](std::size_t) {});
  const ViewPenalty& first_silent = *std::max_element(least.begin(), least.end(), ranks_before);
  const float weight = vertex.weight[first_silent.view];
  return inverse_penalty(std::sqrt(first_silent.penalty) * weight, weight);
}

// The views that may exceed the threshold somewhere in the block.
void PlaneTiles::find_candidates(const Eigen::Vector3f& direction, float least_threshold) {
  const RectifiedViews::Block& block = *block_;
  const std::size_t count = block.views.size();
  bounds_.resize(std::max(bounds_.size(), count));
  candidates_.resize(count);
  constexpr float any_angle = 1e3F;
  const float angle = least_threshold > 1 / any_angle ? 1 / least_threshold - same_ray_rad : any_angle;
  nearness(direction, block.ray_x.data(), block.ray_y.data(), block.ray_z.data(), block.most.data(),
           block.spread_rad.data(), angle, count, bounds_.data());
  std::size_t found = 0;
  for (std::size_t i = 0; i < count; ++i) {
    candidates_[found] = static_cast<std::uint32_t>(i);
    found += bounds_[i] < 0 ? 1 : 0;
  }
  candidates_.resize(found);
  for (const std::uint32_t slot : candidates_) look_up(slot);
}

// Few views that matter in a block have an inverse penalty below.
float PlaneTiles::least_threshold(const Wanted& wanted, int bx, int by) const {
  const std::size_t row = static_cast<std::size_t>(views_.blocks()) + 1;
  const float* const above =
      wanted.thresholds.data() + static_cast<std::size_t>(by) * row + static_cast<std::size_t>(bx);
  const float* const below = above + row;
  return slack * std::min({above[0], above[1], below[0], below[1]});
}

void PlaneTiles::begin_block(int bx, int by) {
  block_ = &views_.block(bx, by);
  corner_ = views_.grid().at(static_cast<float>(bx * block_side) + 0.5F, static_cast<float>(by * block_side) + 0.5F);
  looked_up_.assign(block_->views.size(), 0);
  rays_.clear();
}

// Computes a view's rays to the block, the same for all directions, when it is first asked for.
void PlaneTiles::look_up(std::size_t slot) {
  if (looked_up_[slot] != 0) return;
  const TexelGrid& grid = views_.grid();
  for (std::size_t q = 0; q < quarters; ++q) {
    const auto [x, y] = texel_of(q, 0);
    look_from(views_.centre(block_->views[slot]),
              corner_ + static_cast<float>(x) * grid.step_x + static_cast<float>(y) * grid.step_y, grid.step_x,
              grid.step_y, block_->shown(slot, q), rays_.emplace_back());
  }
  looked_up_[slot] = static_cast<std::uint32_t>(rays_.size() / quarters);
}

void PlaneTiles::blend_quarter(const Wanted& wanted, std::size_t quarter, float least, BlendedQuarter& out) {
  speakers_.resize(candidates_.size());
  inverse_penalties_.resize(std::max(inverse_penalties_.size(), candidates_.size()));
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    const std::uint32_t slot = candidates_[c];
    speakers_[c] = {&rays_[(looked_up_[slot] - 1) * quarters + quarter], block_->shown(slot, quarter),
                    views_.unit(block_->views[slot])};
  }
  const std::size_t count = inverse_penalties(wanted.direction, least, speakers_, inverse_penalties_.data());
  Quarter threshold;
  inverse_thresholds({inverse_penalties_.data(), count}, k_, least, threshold);
  blend({speakers_.data(), count}, inverse_penalties_.data(), threshold, out);
}

}  // namespace mf
