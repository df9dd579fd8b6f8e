// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

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

// ---- a quarter of a block: 4 × 4 texels, one a lane ----

inline constexpr int quarter_side = 4;
inline constexpr std::size_t quarters = 4;        // of a block: quarter 2 y + x
inline constexpr std::size_t quarter_lanes = 16;  // lane 4 y + x
// Column and row of a lane's texel in its block.
[[nodiscard]] constexpr std::array<int, 2> texel_of(std::size_t quarter, std::size_t lane) {
  const int q = static_cast<int>(quarter), i = static_cast<int>(lane);
  return {q % 2 * quarter_side + i % quarter_side, q / 2 * quarter_side + i / quarter_side};
}
// A vector of the compiler's (GCC, Clang): unlike an array it stays in registers while a loop adds to it.
struct alignas(64) Quarter {
  using Vector = float __attribute__((vector_size(64)));
  Vector v;
};
static_assert(sizeof(Quarter) == quarter_lanes * sizeof(float));

struct QuarterRays {
  Quarter x, y, z;  // unit, from one view's centre to the texels
  Quarter weight;   // the view's, 0 where it says nothing
};
// What a view shows of a quarter as half floats: its straight red, green and blue in the view's unit, its weight.
inline constexpr std::size_t quarter_halves = 4 * quarter_lanes;

// The rays to the texels first + x step_x + y step_y.
void look_from(const Eigen::Vector3f& centre, const Eigen::Vector3f& first, const Eigen::Vector3f& step_x,
               const Eigen::Vector3f& step_y, const std::uint16_t* shown, QuarterRays& rays);

// A view that may speak for a quarter.
struct QuarterView {
  const QuarterRays* rays;
  const std::uint16_t* shown;
  float unit;  // of `shown`
};
// Of `views` those whose inverse penalty exceeds `least` at some texel: keeps them, in order, at the front of `views`,
// and their inverse penalties in `inverse`. Returns how many.
std::size_t inverse_penalties(const Eigen::Vector3f& direction, float least, std::span<QuarterView> views,
                              Quarter* inverse);
// The (k + 1)-th largest at every texel, or `least` where that is smaller. Precondition: 1 ≤ k ≤ 64.
void inverse_thresholds(std::span<const Quarter> inverse_penalties, std::size_t k, float least, Quarter& out);

struct BlendedQuarter {
  Quarter red, green, blue, confidence;
};
// Blends views with Buehler's weights 1/penalty − 1/threshold where that is positive (view_weights.h). The confidence
// is the sum of the weights of the views that speak, at most 1.
void blend(std::span<const QuarterView> views, const Quarter* inverse_penalties, const Quarter& inverse_threshold,
           BlendedQuarter& out);

}  // namespace mf
