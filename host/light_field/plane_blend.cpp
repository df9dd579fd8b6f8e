// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/plane_blend.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "host/blending/vectorized.h"
#include "host/blending/view_weights.h"
#include "host/light_field/half_floats.h"

namespace mf {

namespace {

constexpr float pi = std::numbers::pi_v<float>;

using Floats = Quarter::Vector;
using Mask = std::int32_t __attribute__((vector_size(64)));

[[gnu::always_inline]] inline bool any(const Mask& mask) {
  using Bytes = std::int8_t __attribute__((vector_size(quarter_lanes)));
  const auto halves = std::bit_cast<std::array<std::uint64_t, 2>>(__builtin_convertvector(mask, Bytes));
  return (halves[0] | halves[1]) != 0;
}

[[gnu::always_inline]] inline Floats root(const Floats& x) {
  Floats out;
  for (std::size_t i = 0; i < quarter_lanes; ++i) out[i] = std::sqrt(x[i]);
  return out;
}

// shifted_half() of a quarter's texels in one channel.
[[gnu::always_inline]] inline Floats shifted_halves(const std::uint16_t* halves) {
  using Halves = std::uint16_t __attribute__((vector_size(2 * quarter_lanes)));
  using Bits = std::uint32_t __attribute__((vector_size(4 * quarter_lanes)));
  Halves h;
  std::memcpy(&h, halves, sizeof h);
  return std::bit_cast<Floats>(__builtin_convertvector(h, Bits) << 13);
}

// The angle between unit rays a squared chord apart: 2 asin(c / 2) = c (1 + c²/24 + …), fitted to 6 · 10⁻⁶ for c² ≤ 2;
// beyond, by its complement.
[[gnu::always_inline]] inline Floats angle_of(const Floats& squared_chord) {
  const Mask beyond = squared_chord > 2;
  const Floats c2 = beyond ? 4 - squared_chord : squared_chord;
  const Floats angle =
      root(c2) * (1.00000566F + c2 * (0.0415357F + c2 * (0.0051649F + c2 * (0.0001128F + c2 * 0.0003797F))));
  return beyond ? pi - angle : angle;
}

}  // namespace

MF_VECTORIZED void squared_chords(const Eigen::Vector3f& direction, const float* ray_x, const float* ray_y,
                                  const float* ray_z, const float* factor, std::size_t n, float* out) {
  const float dx = direction.x(), dy = direction.y(), dz = direction.z();
  for (std::size_t i = 0; i < n; ++i) {
    const float x = ray_x[i] - dx, y = ray_y[i] - dy, z = ray_z[i] - dz;
    out[i] = (x * x + y * y + z * z) * factor[i];
  }
}

MF_VECTORIZED void nearness(const Eigen::Vector3f& direction, const float* ray_x, const float* ray_y,
                            const float* ray_z, const float* weight, const float* spread, float angle, std::size_t n,
                            float* out) {
  const float dx = direction.x(), dy = direction.y(), dz = direction.z();
  for (std::size_t i = 0; i < n; ++i) {
    const float x = ray_x[i] - dx, y = ray_y[i] - dy, z = ray_z[i] - dz;
    const float reach = weight[i] * angle + spread[i];
    out[i] = x * x + y * y + z * z - reach * reach;
  }
}

float inverse_penalty(float chord, float weight) {
  const float angle = 2 * std::asin(std::min(0.5F * chord, 1.0F));
  return weight / (angle + same_ray_rad * weight);
}

MF_VECTORIZED void look_from(const Eigen::Vector3f& centre, const Eigen::Vector3f& first, const Eigen::Vector3f& step_x,
                             const Eigen::Vector3f& step_y, const std::uint16_t* shown, QuarterRays& rays) {
  const Eigen::Vector3f to_first = first - centre;
  const Floats column = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
  const Floats row = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  const Floats x = to_first.x() + column * step_x.x() + row * step_y.x();
  const Floats y = to_first.y() + column * step_x.y() + row * step_y.y();
  const Floats z = to_first.z() + column * step_x.z() + row * step_y.z();
  const Floats inverse = 1 / root(x * x + y * y + z * z);
  rays.x.v = x * inverse;
  rays.y.v = y * inverse;
  rays.z.v = z * inverse;
  rays.weight.v = half_unshift * shifted_halves(shown + 3 * quarter_lanes);
}

MF_VECTORIZED std::size_t inverse_penalties(const Eigen::Vector3f& direction, float least, std::span<QuarterView> views,
                                            Quarter* inverse) {
  const float dx = direction.x(), dy = direction.y(), dz = direction.z();
  std::size_t kept = 0;
  for (const QuarterView& view : views) {
    const Floats x = view.rays->x.v - dx, y = view.rays->y.v - dy, z = view.rays->z.v - dz;
    const Floats weight = view.rays->weight.v;
    const Floats here = weight / (angle_of(x * x + y * y + z * z) + same_ray_rad * weight);
    inverse[kept].v = here;
    views[kept] = view;
    kept += any(here > least) ? 1 : 0;
  }
  return kept;
}

namespace {

// At most n views speak. The n largest of every texel, falling, in registers if they are few: each view sinks to its
// place. What is not wanted of the n is taken by infinity.
template <std::size_t n>
[[gnu::always_inline]] inline void find_threshold(std::span<const Quarter> inverse_penalties, std::size_t k,
                                                  float least, Quarter& out) {
  std::array<Floats, n> falling;
#pragma GCC unroll 16
  for (std::size_t j = 0; j < n; ++j)
    falling[j] = Floats{} + (j + k + 1 < n ? std::numeric_limits<float>::infinity() : least);
  for (const Quarter& inverse : inverse_penalties) {
    Floats sinking = inverse.v;
#pragma GCC unroll 16
    for (std::size_t j = 0; j < n; ++j) {
      const Floats here = falling[j];
      falling[j] = here > sinking ? here : sinking;
      sinking = here < sinking ? here : sinking;
    }
  }
  out.v = falling[n - 1];
}

}  // namespace

MF_VECTORIZED void inverse_thresholds(std::span<const Quarter> inverse_penalties, std::size_t k, float least,
                                      Quarter& out) {
  constexpr std::size_t usual = 16, most = 65;
  if (k < usual)
    find_threshold<usual>(inverse_penalties, k, least, out);
  else
    find_threshold<most>(inverse_penalties, k, least, out);
}

MF_VECTORIZED void blend(std::span<const QuarterView> views, const Quarter* inverse_penalties,
                         const Quarter& inverse_threshold, BlendedQuarter& out) {
  Floats red{}, green{}, blue{}, weights{}, seen{};
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::uint16_t* const shown = views[i].shown;
    const Floats inverse = inverse_penalties[i].v, above = inverse - inverse_threshold.v;
    const Mask speaks = above > 0;
    const Floats weight = (speaks ? above : 0) + ray_weight_tie * inverse;
    weights += weight;
    seen += speaks ? half_unshift * shifted_halves(shown + 3 * quarter_lanes) : 0;
    // In two steps, each within a float's range: half_unshift · unit may not be.
    const Floats scaled = weight * views[i].unit;
    red += scaled * (half_unshift * shifted_halves(shown));
    green += scaled * (half_unshift * shifted_halves(shown + quarter_lanes));
    blue += scaled * (half_unshift * shifted_halves(shown + 2 * quarter_lanes));
  }
  constexpr float nobody = 1e-30F;  // where no view speaks, 0 times this one's inverse is still 0
  const Floats inverse = 1 / (weights > nobody ? weights : nobody);
  out.red.v = red * inverse;
  out.green.v = green * inverse;
  out.blue.v = blue * inverse;
  // Where views only tie with the threshold the texel was seen all the same: it is no hole.
  const Floats tied = weights < ray_weight_tie ? weights : ray_weight_tie;
  const Floats confidence = seen > tied ? seen : tied;
  out.confidence.v = confidence < 1 ? confidence : 1;
}

}  // namespace mf
