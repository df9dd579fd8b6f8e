// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/plane_blend.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/blending/vectorized.h"
#include "host/blending/view_weights.h"
#include "host/light_field/half_floats.h"

namespace mf {

namespace {

constexpr float pi = std::numbers::pi_v<float>;

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

MF_VECTORIZED void inverse_penalties(const Lanes3& p, const Eigen::Vector3f& centre, const std::uint16_t* weights,
                                     Lanes& __restrict inverse) {
  const float cx = centre.x(), cy = centre.y(), cz = centre.z();
  for (std::size_t i = 0; i < block_lanes; ++i) {
    const float x = p.x.v[i] - cx, y = p.y.v[i] - cy, z = p.z.v[i] - cz;
    // θ = 2 atan(sin θ / (1 + cos θ)); beyond 90° by its complement.
    const float across2 = x * x + y * y, across = std::sqrt(across2), along = std::sqrt(across2 + z * z) + z;
    const float tangent = std::min(across, along) / std::max(across, along), t2 = tangent * tangent;
    // Abramowitz & Stegun 4.4.49 with fewer terms, to 10⁻⁵.
    const float half =
        tangent * (0.9998660F + t2 * (-0.3302995F + t2 * (0.1801410F + t2 * (-0.0851330F + t2 * 0.0208351F))));
    const float angle = across < along ? 2 * half : pi - 2 * half;
    const float a = half_unshift * shifted_half(weights[i]);
    inverse.v[i] = a / (angle + same_ray_rad * a);
  }
}

MF_VECTORIZED void inverse_thresholds(std::span<const Lanes> inverse_penalties, std::size_t k, float least,
                                      std::vector<Lanes>& sinking, Lanes& out) {
  // The k + 1 largest of every texel, falling: each view sinks to its place.
  sinking.resize(std::max(sinking.size(), k + 2));
  std::size_t known = 0;
  for (const Lanes& inverse : inverse_penalties) {
    Lanes& next = sinking[k + 1];
    next = inverse;
    if (known <= k) sinking[known++].v.fill(least);
    for (std::size_t j = 0; j < known; ++j) {
      Lanes& here = sinking[j];
      for (std::size_t i = 0; i < block_lanes; ++i) {
        const float a = here.v[i], b = next.v[i];
        here.v[i] = std::max(a, b);
        next.v[i] = std::min(a, b);
      }
    }
  }
  if (known == k + 1)
    out = sinking[k];
  else
    out.v.fill(least);
}

MF_VECTORIZED void add_view(const Lanes& inverse_penalty, const Lanes& inverse_threshold, const std::uint16_t* texels,
                            float unit, ViewSums& __restrict sums) {
  for (std::size_t i = 0; i < block_lanes; ++i) {
    const float inverse = inverse_penalty.v[i];
    const float above = inverse - inverse_threshold.v[i], speaks = above > 0 ? 1.0F : 0.0F;
    const float weight = speaks * above + ray_weight_tie * inverse;
    sums.weight.v[i] += weight;
    sums.seen.v[i] += speaks * (half_unshift * shifted_half(texels[3 * block_lanes + i]));
    // In two steps, each within a float's range: half_unshift · unit may not be.
    const float scaled = weight * unit;
    sums.colour.x.v[i] += scaled * (half_unshift * shifted_half(texels[i]));
    sums.colour.y.v[i] += scaled * (half_unshift * shifted_half(texels[block_lanes + i]));
    sums.colour.z.v[i] += scaled * (half_unshift * shifted_half(texels[2 * block_lanes + i]));
  }
}

MF_VECTORIZED void finish(const ViewSums& sums, Lanes3& colour, Lanes& confidence) {
  constexpr float nobody = 1e-30F;  // where no view speaks, 0 times this one's inverse is still 0
  for (std::size_t i = 0; i < block_lanes; ++i) {
    const float inverse = 1 / std::max(sums.weight.v[i], nobody);
    colour.x.v[i] = sums.colour.x.v[i] * inverse;
    colour.y.v[i] = sums.colour.y.v[i] * inverse;
    colour.z.v[i] = sums.colour.z.v[i] * inverse;
    // Where views only tie with the threshold the texel was seen all the same: it is no hole.
    const float tied = std::min(sums.weight.v[i], ray_weight_tie);
    confidence.v[i] = std::min(std::max(sums.seen.v[i], tied), 1.0F);
  }
}

}  // namespace mf
