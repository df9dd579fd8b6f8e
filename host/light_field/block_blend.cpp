// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/block_blend.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/blending/vectorized.h"
#include "host/blending/view_weights.h"

namespace mf {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float largest = std::numeric_limits<float>::max();
constexpr std::size_t side = block_side;

// A texel's weights between vertices 0 and 1 (texels 0 to 3) or 1 and 2 (4 to 7).
constexpr std::array<std::array<float, side>, patch_side> vertex_weight{
    {{0.875F, 0.625F, 0.375F, 0.125F, 0, 0, 0, 0},
     {0.125F, 0.375F, 0.625F, 0.875F, 0.875F, 0.625F, 0.375F, 0.125F},
     {0, 0, 0, 0, 0.125F, 0.375F, 0.625F, 0.875F}}};

[[gnu::always_inline]] inline void interpolate_channel(const float* vertices, float* out) {
  for (std::size_t y = 0; y < side; ++y) {
    std::array<float, patch_side> row;
    for (std::size_t x = 0; x < patch_side; ++x)
      row[x] = vertex_weight[0][y] * vertices[x] + vertex_weight[1][y] * vertices[patch_side + x] +
               vertex_weight[2][y] * vertices[2 * patch_side + x];
    for (std::size_t x = 0; x < side; ++x)
      out[y * side + x] = row[0] * vertex_weight[0][x] + row[1] * vertex_weight[1][x] + row[2] * vertex_weight[2][x];
  }
}

Patch<float> channel(const Patch<Eigen::Vector4f>& values, Eigen::Index c) {
  Patch<float> out;
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = values[i][c];
  return out;
}

}  // namespace

MF_VECTORIZED void interpolate(const Patch<float>& vertices, Lanes& out) {
  interpolate_channel(vertices.data(), out.v.data());
}

void interpolate(const Patch<Eigen::Vector4f>& vertices, Lanes4& out) {
  interpolate(channel(vertices, 0), out.x);
  interpolate(channel(vertices, 1), out.y);
  interpolate(channel(vertices, 2), out.z);
  interpolate(channel(vertices, 3), out.w);
}

void set_points(const Eigen::Vector3f& first, const Eigen::Vector3f& step_x, const Eigen::Vector3f& step_y,
                Lanes3& out) {
  for (std::size_t i = 0; i < block_lanes; ++i) {
    const float x = static_cast<float>(i % side), y = static_cast<float>(i / side);
    out.x.v[i] = first.x() + x * step_x.x() + y * step_y.x();
    out.y.v[i] = first.y() + x * step_x.y() + y * step_y.y();
    out.z.v[i] = first.z() + x * step_x.z() + y * step_y.z();
  }
}

MF_VECTORIZED void distance_penalties(const Lanes3& p, const Lanes4& proxy_point, const Eigen::Vector3f& centre,
                                      const Lanes& weight, Lanes& penalty) {
  const float cx = centre.x(), cy = centre.y(), cz = centre.z();
  for (std::size_t i = 0; i < block_lanes; ++i) {
    const float s = proxy_point.w.v[i];
    const float rx = proxy_point.x.v[i] - s * cx, ry = proxy_point.y.v[i] - s * cy, rz = proxy_point.z.v[i] - s * cz;
    const float qx = p.x.v[i] - cx, qy = p.y.v[i] - cy, qz = p.z.v[i] - cz;
    const float x = qy * rz - qz * ry, y = qz * rx - qx * rz, z = qx * ry - qy * rx;
    const float distance = std::sqrt((x * x + y * y + z * z) / (rx * rx + ry * ry + rz * rz));
    penalty.v[i] = weight.v[i] >= smallest_view_weight ? distance / weight.v[i] : infinity;
  }
}

LeastLanes::LeastLanes(std::size_t count) : count_(count) {
  for (std::size_t j = 0; j < count; ++j) rising_[j].v.fill(infinity);
}

namespace {

// A value sinks past all that are less. Nothing changes when none is below the last.
MF_VECTORIZED bool is_less_somewhere(const Lanes& values, const Lanes& last) {
  int less = 0;
  for (std::size_t i = 0; i < block_lanes; ++i) less += values.v[i] < last.v[i] ? 1 : 0;
  return less > 0;
}

MF_VECTORIZED void sink(Lanes values, std::span<Lanes> rising) {
  for (Lanes& lanes : rising)
    for (std::size_t i = 0; i < block_lanes; ++i) {
      const float a = lanes.v[i], b = values.v[i];
      lanes.v[i] = std::min(a, b);
      values.v[i] = std::max(a, b);
    }
}

}  // namespace

void LeastLanes::add(const Lanes& values) {
  if (!is_less_somewhere(values, greatest())) return;
  known_ = std::min(known_ + 1, count_);
  sink(values, {rising_.data(), known_});
}

MF_VECTORIZED void weights_of(std::span<Lanes> penalties, std::span<const Lanes> view_weights, int k, float floor,
                              Lanes& confidence) {
  const std::size_t kept = static_cast<std::size_t>(k) + 1;
  LeastLanes least(kept);
  for (const Lanes& penalty : penalties) least.add(penalty);
  Lanes inverse_threshold, sum{};
  for (std::size_t i = 0; i < block_lanes; ++i) {
    inverse_threshold.v[i] = 1 / (least[kept - 1].v[i] + floor);  // 0 where there is no (k + 1)-th view
    confidence.v[i] = 0;
  }
  const Lanes& last = least[kept - 2];
  for (std::size_t c = 0; c < penalties.size(); ++c)
    for (std::size_t i = 0; i < block_lanes; ++i) {
      const float penalty = penalties[c].v[i] + floor;
      const float above = std::max(0.0F, 1 - penalty * inverse_threshold.v[i]) + ray_weight_tie;
      const float speaks = penalties[c].v[i] <= std::min(last.v[i], largest) ? 1.0F : 0.0F;
      const float weight = speaks * above / penalty;
      confidence.v[i] += speaks * view_weights[c].v[i];
      sum.v[i] += weight;
      penalties[c].v[i] = weight;
    }
  for (std::size_t i = 0; i < block_lanes; ++i) {
    constexpr float nobody = 1e-30F;  // where no view speaks, 0 times this one's inverse is still 0
    sum.v[i] = 1 / std::max(sum.v[i], nobody);
    confidence.v[i] = std::min(confidence.v[i], 1.0F);
  }
  for (std::size_t c = 0; c < penalties.size(); ++c)
    for (std::size_t i = 0; i < block_lanes; ++i) {
      const float a = view_weights[c].v[i];  // too small: the weight is 0
      penalties[c].v[i] *= sum.v[i] / std::max(a, smallest_view_weight);
    }
}

namespace {

MF_VECTORIZED void add_channel(const Patch<float>& seen, const Lanes& weight, Lanes& colour) {
  Lanes here;
  interpolate_channel(seen.data(), here.v.data());
  for (std::size_t i = 0; i < block_lanes; ++i) colour.v[i] += weight.v[i] * here.v[i];
}

}  // namespace

void add_colours(const Patch<Eigen::Vector4f>& seen, const Lanes& weight, Lanes3& colour) {
  add_channel(channel(seen, 0), weight, colour.x);
  add_channel(channel(seen, 1), weight, colour.y);
  add_channel(channel(seen, 2), weight, colour.z);
}

MF_VECTORIZED void add_colours(const Lanes3& seen, const Lanes& weight, Lanes3& colour) {
  for (std::size_t i = 0; i < block_lanes; ++i) {
    colour.x.v[i] += weight.v[i] * seen.x.v[i];
    colour.y.v[i] += weight.v[i] * seen.y.v[i];
    colour.z.v[i] += weight.v[i] * seen.z.v[i];
  }
}

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

MF_VECTORIZED void squared_ray_distances(const Eigen::Vector3f& p, const Eigen::Vector4f& proxy_point,
                                         const float* centre_x, const float* centre_y, const float* centre_z,
                                         std::size_t n, float* out) {
  const float px = p.x(), py = p.y(), pz = p.z();
  const float fx = proxy_point.x(), fy = proxy_point.y(), fz = proxy_point.z(), s = proxy_point.w();
  for (std::size_t i = 0; i < n; ++i) {
    const float cx = centre_x[i], cy = centre_y[i], cz = centre_z[i];
    const float rx = fx - s * cx, ry = fy - s * cy, rz = fz - s * cz;
    const float qx = px - cx, qy = py - cy, qz = pz - cz;
    const float x = qy * rz - qz * ry, y = qz * rx - qx * rz, z = qx * ry - qy * rx;
    out[i] = (x * x + y * y + z * z) / (rx * rx + ry * ry + rz * rz);
  }
}

}  // namespace mf
