// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

namespace mf {

// Blending of captured views in blocks of 8 × 8 texels, one texel a lane: the arithmetic of view_weights.h and
// view_rays.h in plain loops over 64 lanes, compiled for the processor at hand (AVX2 where there is one). Lane 8 y + x
// is texel (x, y) of the block.
inline constexpr int block_side = 8;
inline constexpr std::size_t block_lanes = 64;
struct alignas(64) Lanes {
  std::array<float, block_lanes> v;
};

// Values at a block's 3 × 3 vertices, by rows: they lie on the texels' corners 0, 4 and 8.
inline constexpr int vertex_step = 4;
inline constexpr std::size_t patch_side = 3;
template <typename T>
using Patch = std::array<T, patch_side * patch_side>;

// Bilinear between the vertices.
void interpolate(const Patch<float>&, Lanes& out);

struct Lanes3 {
  Lanes x, y, z;
};
struct Lanes4 {
  Lanes x, y, z, w;
};
// p at every texel: `first` at lane 0, one step along x and one along y.
void set_points(const Eigen::Vector3f& first, const Eigen::Vector3f& step_x, const Eigen::Vector3f& step_y,
                Lanes3& out);
void interpolate(const Patch<Eigen::Vector4f>&, Lanes4& out);

// Views that show less than this of a ray do not speak for it: their penalty is infinite.
inline constexpr float smallest_view_weight = 0.02F;

// ray_distance() of a view with centre C at every texel over the view's weight there.
void distance_penalties(const Lanes3& p, const Lanes4& proxy_point, const Eigen::Vector3f& centre, const Lanes& weight,
                        Lanes& penalty);

// The few least values of every lane, rising.
class LeastLanes {
 public:
  static constexpr std::size_t most = 65;
  // Precondition: 1 ≤ count ≤ most. All infinite at first.
  explicit LeastLanes(std::size_t count);

  void add(const Lanes& values);
  [[nodiscard]] const Lanes& operator[](std::size_t i) const { return rising_[i]; }
  [[nodiscard]] const Lanes& greatest() const { return rising_[count_ - 1]; }

 private:
  std::size_t count_;
  std::size_t known_ = 0;  // beyond, all are infinite
  std::array<Lanes, most> rising_;
};

// blend_weights() for every texel: `penalties` (one a candidate) become weights that sum to 1 over the candidates, each
// divided by the view's own weight, ready for premultiplied colours. `confidence`: the sum of the weights of the views
// that speak, at most 1. Precondition: 1 ≤ k ≤ 64.
void weights_of(std::span<Lanes> penalties, std::span<const Lanes> view_weights, int k, float floor, Lanes& confidence);

// colour += weight · seen (premultiplied red, green, blue at the vertices).
void add_colours(const Patch<Eigen::Vector4f>& seen, const Lanes& weight, Lanes3& colour);
// The same where they are known at every texel.
void add_colours(const Lanes3& seen, const Lanes& weight, Lanes3& colour);

// Copies a block's lanes into a tile of n² texels, as far as it reaches.
void store_block(const Lanes3& colour, const Lanes& confidence, int block_x, int block_y, int n, Eigen::Vector4f* tile);

// ---- ranking: one ray, many views ----

// Squared ray_distance() of n views whose centres are given by coordinate.
void squared_ray_distances(const Eigen::Vector3f& p, const Eigen::Vector4f& proxy_point, const float* centre_x,
                           const float* centre_y, const float* centre_z, std::size_t n, float* out);

}  // namespace mf
