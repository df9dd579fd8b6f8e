// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host/light_field/block_blend.h"

namespace mf {

// The arithmetic of blending with the plane as proxy, where the penalty of a view is the angle between its ray and the
// wanted one over the view's weight. What adds up is the penalty's inverse, weight / (angle + floor · weight).

inline constexpr float same_ray_rad = 1e-4F;  // the floor: rays closer than this are the same

// |ray − direction|² · factor for n unit rays.
void squared_chords(const Eigen::Vector3f& direction, const float* ray_x, const float* ray_y, const float* ray_z,
                    const float* factor, std::size_t n, float* out);
// |ray − direction|² − (weight · angle + spread)² for n unit rays: below 0 where a ray turned by at most `spread` may
// come as near as weight · angle.
void nearness(const Eigen::Vector3f& direction, const float* ray_x, const float* ray_y, const float* ray_z,
              const float* weight, const float* spread, float angle, std::size_t n, float* out);

// A penalty's inverse for one ray.
[[nodiscard]] float inverse_penalty(float chord, float weight);
// At every texel, 0 where the view's weight is. p, centre: in a frame whose third axis is the wanted direction.
// `weights`: half floats by lane.
void inverse_penalties(const Lanes3& p, const Eigen::Vector3f& centre, const std::uint16_t* weights, Lanes& inverse);

// The (k + 1)-th largest at every texel, or `least` where that is smaller. `sinking`: working memory.
void inverse_thresholds(std::span<const Lanes> inverse_penalties, std::size_t k, float least,
                        std::vector<Lanes>& sinking, Lanes& out);

// Sums over a block's views; the colour is the wanted one times `weight`.
struct ViewSums {
  Lanes weight, seen;  // `seen`: the sum of the weights of the views that speak
  Lanes3 colour;
};

// Adds a view with Buehler's weight 1/penalty − 1/threshold where that is positive (view_weights.h). `texels`: 4 × 64
// half floats, its red, green and blue in `unit`, its weight.
void add_view(const Lanes& inverse_penalty, const Lanes& inverse_threshold, const std::uint16_t* texels, float unit,
              ViewSums& sums);
void finish(const ViewSums& sums, Lanes3& colour, Lanes& confidence);

}  // namespace mf
