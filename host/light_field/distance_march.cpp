// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/distance_march.h"

#include <array>
#include <cmath>
#include <cstdint>

#include "host/blending/vectorized.h"

namespace mf {

namespace {

constexpr float nearest_m = 0.2F;
constexpr float largest_inverse = 1 / nearest_m;
constexpr int steps = 24;
// Steps that are taken at once, spelled out: look-ups in a map are beyond the compiler's own vectorizing.
constexpr int wide = 8;
static_assert(steps % wide == 0);
using Floats8 = float __attribute__((vector_size(4 * wide)));
using Ints8 = std::int32_t __attribute__((vector_size(4 * wide)));

[[gnu::always_inline]] inline void root(const Floats8& x, Floats8& out) {
  for (int i = 0; i < wide; ++i) out[i] = std::sqrt(x[i]);
}

// Bilinear at positions in [0, 1]².
[[gnu::always_inline]] inline void look_up(const ImageF& map, const Floats8& u, const Floats8& v, Floats8& out) {
  const float last_x = static_cast<float>(map.width - 1), last_y = static_cast<float>(map.height - 1);
  const Floats8 zero{};
  Floats8 x = u * static_cast<float>(map.width) - 0.5F, y = v * static_cast<float>(map.height) - 0.5F;
  x = x > 0 ? x : zero;
  y = y > 0 ? y : zero;
  x = x < last_x ? x : zero + last_x;
  y = y < last_y ? y : zero + last_y;
  const Ints8 x0 = __builtin_convertvector(x, Ints8), y0 = __builtin_convertvector(y, Ints8);
  const Floats8 right = x - __builtin_convertvector(x0, Floats8), down = y - __builtin_convertvector(y0, Floats8);
  const Ints8 first = y0 * map.width + x0;
  const Ints8 step_x = (x0 < map.width - 1) & 1, step_y = (y0 < map.height - 1) & map.width;
  const float* const values = map.data.data();
  Floats8 top_left, top_right, bottom_left, bottom_right;
  for (int i = 0; i < wide; ++i) {
    const float* const value = values + first[i];
    top_left[i] = value[0];
    top_right[i] = value[step_x[i]];
    bottom_left[i] = value[step_y[i]];
    bottom_right[i] = value[step_y[i] + step_x[i]];
  }
  const Floats8 top = top_left + right * (top_right - top_left);
  const Floats8 bottom = bottom_left + right * (bottom_right - bottom_left);
  out = top + down * (bottom - top);
}

// How far behind the surface the ray is at some inverse distances: the centre's distance to it over the surface's
// there, less one, times the inverse distance.
[[gnu::always_inline]] inline void look_behind(const ImageF& map, const float* from_centre, const float* direction,
                                               const Floats8& inverse, Floats8& out) {
  // From the centre, times the inverse distance.
  const Floats8 x = direction[0] + inverse * from_centre[0], y = direction[1] + inverse * from_centre[1],
                z = direction[2] + inverse * from_centre[2];
  Floats8 length, slant, radius;
  root(x * x + y * y + z * z, length);
  const Floats8 zero{};
  // equal_area_square(), of a vector that is no unit one.
  root(length * (length + (z > 0 ? z : zero)), slant);
  Floats8 disc_x = x / slant, disc_y = y / slant;
  root(disc_x * disc_x + disc_y * disc_y, radius);
  const Floats8 shrink = 0.5F / (radius > 1 ? radius : zero + 1);
  Floats8 surface;
  look_up(map, 0.5F + disc_x * shrink, 0.5F - disc_y * shrink, surface);
  out = length * surface - inverse;
}

MF_VECTORIZED float march(const ImageF& map, const float* from_centre, const float* direction) {
  // From near to far in inverse distance, which moves evenly over the picture: the first crossing is what is seen.
  float nearer_behind = -1;
  for (int begin = 1; begin <= steps; begin += wide) {
    Floats8 inverse, behind;
    for (int i = 0; i < wide; ++i) inverse[i] = largest_inverse * (1 - static_cast<float>(begin + i) / steps);
    look_behind(map, from_centre, direction, inverse, behind);
    for (int i = 0; i < wide; ++i) {
      if (behind[i] > 0) {
        const float nearer = largest_inverse * (1 - static_cast<float>(begin + i - 1) / steps);
        const float share = nearer_behind < 0 ? nearer_behind / (nearer_behind - behind[i]) : 0;
        return nearer + share * (inverse[i] - nearer);
      }
      nearer_behind = behind[i];
    }
  }
  return 0;
}

}  // namespace

float march_to_surface(const ImageF& inverse_distance, const Eigen::Vector3f& from_centre,
                       const Eigen::Vector3f& direction) {
  return march(inverse_distance, from_centre.data(), direction.data());
}

}  // namespace mf
