// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace mf {

// Half floats (IEEE 754 binary16) that are not negative, in loops that any compiler vectorizes.

// A normal half h or zero shifted into a float is h · 2⁻¹¹²: multiplied into a weight, the rest of the decoding is
// free.
inline constexpr float half_unshift = 0x1p112F;
[[nodiscard]] inline float shifted_half(std::uint16_t h) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(h) << 13U);
}

// Rounded to nearest even, as OpenEXR does; above 65504 the largest half, below 0 (and NaN) zero.
[[nodiscard]] inline std::uint16_t to_half(float value) {
  constexpr float largest = 65504;
  constexpr float smallest_normal = 0x1p-14F;
  constexpr float align_subnormals = 0.5F;  // added, a subnormal half's bits are the sum's lowest
  const float f = value > 0 ? std::min(value, largest) : 0.0F;
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(f);
  constexpr std::uint32_t exponent_shift = 112U << 23U;
  const std::uint32_t normal = (bits - exponent_shift + 0xfffU + ((bits >> 13U) & 1U)) >> 13U;
  const std::uint32_t subnormal =
      std::bit_cast<std::uint32_t>(f + align_subnormals) - std::bit_cast<std::uint32_t>(align_subnormals);
  return static_cast<std::uint16_t>(f < smallest_normal ? subnormal : normal);
}

// The same, with zero for what only a subnormal could hold.
[[nodiscard]] inline std::uint16_t to_normal_half(float value) {
  constexpr std::uint16_t smallest_normal = 0x0400;
  const std::uint16_t h = to_half(value);
  return h < smallest_normal ? std::uint16_t{0} : h;
}

}  // namespace mf
