// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/plane_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/light_field/plane_blend.h"

namespace mf {

namespace {

constexpr float slack = 0.95F;  // between the vertices a threshold may be less than at any of them

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
    : views_(views), field_(field), k_(static_cast<std::size_t>(k)) {}

void PlaneTiles::fill(std::span<const std::size_t> directions, Eigen::Vector4f* tiles) {
  find_thresholds(directions);
  const std::size_t texels = field_.texel_count();
  for (int y = 0; y < views_.blocks(); ++y)
    for (int x = 0; x < views_.blocks(); ++x)
      for (std::size_t i = 0; i < directions.size(); ++i) {
        Lanes3 colour;
        Lanes confidence;
        blend(wanted_[i], x, y, colour, confidence);
        store_block(colour, confidence, x, y, field_.resolution, tiles + i * texels);
      }
}

void PlaneTiles::find_thresholds(std::span<const std::size_t> directions) {
  const std::size_t blocks = static_cast<std::size_t>(views_.blocks());
  const Eigen::Matrix3f turn = field_.plane.world_from_plane.rotation.cast<float>().toRotationMatrix();
  wanted_.resize(directions.size());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    Wanted& w = wanted_[i];
    w.direction = turn * field_.directions.directions[directions[i]];
    const Eigen::Vector3f aside = w.direction.unitOrthogonal();
    w.from_world << aside.transpose(), w.direction.cross(aside).transpose(), w.direction.transpose();
    w.least_thresholds.assign(blocks * blocks, std::numeric_limits<float>::max());
  }
  for (std::size_t y = 0; y <= blocks; ++y)
    for (std::size_t x = 0; x <= blocks; ++x)
      for (Wanted& w : wanted_) {
        const float here =
            slack * inverse_threshold_at(views_.vertex(static_cast<int>(x), static_cast<int>(y)), w.direction);
        for (std::size_t by = y - std::min<std::size_t>(y, 1); by <= std::min(y, blocks - 1); ++by)
          for (std::size_t bx = x - std::min<std::size_t>(x, 1); bx <= std::min(x, blocks - 1); ++bx) {
            float& least = w.least_thresholds[by * blocks + bx];
            least = std::min(least, here);
          }
      }
}

float PlaneTiles::inverse_threshold_at(const RectifiedViews::Vertex& vertex, const Eigen::Vector3f& direction) {
  const std::size_t count = vertex.weight.size();
  if (count <= k_) return 0;
  bounds_.resize(std::max(bounds_.size(), count));
  squared_chords(direction, vertex.ray_x.data(), vertex.ray_y.data(), vertex.ray_z.data(), vertex.factor.data(), count,
                 bounds_.data());
  const std::vector<ViewPenalty>& least =
      ranking_.find(bounds_.data(), count, k_ + 1, [&](std::size_t i) { return bounds_[i]; });
  const ViewPenalty& first_silent = *std::max_element(least.begin(), least.end(), ranks_before);
  const float weight = vertex.weight[first_silent.view];
  return inverse_penalty(std::sqrt(first_silent.penalty) * weight, weight);
}

// The views that may exceed the threshold somewhere in the block.
void PlaneTiles::find_candidates(const RectifiedViews::Block& block, const Eigen::Vector3f& direction,
                                 float least_threshold) {
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
}

void PlaneTiles::blend(const Wanted& wanted, int bx, int by, Lanes3& colour, Lanes& confidence) {
  const RectifiedViews::Block& block = views_.block(bx, by);
  const float least = wanted.least_thresholds[static_cast<std::size_t>(by * views_.blocks() + bx)];
  find_candidates(block, wanted.direction, least);
  const TexelGrid& grid = views_.grid();
  Lanes3 p;
  set_points(wanted.from_world *
                 grid.at(static_cast<float>(bx * block_side) + 0.5F, static_cast<float>(by * block_side) + 0.5F),
             wanted.from_world * grid.step_x, wanted.from_world * grid.step_y, p);
  const std::size_t count = candidates_.size();
  inverse_penalties_.resize(std::max(inverse_penalties_.size(), count));
  for (std::size_t c = 0; c < count; ++c)
    inverse_penalties(p, wanted.from_world * views_.centre(block.views[candidates_[c]]), block.weights(candidates_[c]),
                      inverse_penalties_[c]);
  Lanes threshold;
  inverse_thresholds({inverse_penalties_.data(), count}, k_, least, sinking_, threshold);
  ViewSums sums{};
  for (std::size_t c = 0; c < count; ++c)
    add_view(inverse_penalties_[c], threshold, block.texels(candidates_[c]), views_.unit(block.views[candidates_[c]]),
             sums);
  finish(sums, colour, confidence);
}

}  // namespace mf
