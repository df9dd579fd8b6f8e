// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cstdint>

#include "host/light_field/field_views.h"

namespace mf {

// A point of the proxy, homogeneous and in the world: (ω + s p, s) for the ray from p towards ω that meets the proxy at
// the distance 1/s; s = 0 is a direction.
using ProxyPoint = Eigen::Vector4f;
[[nodiscard]] inline ProxyPoint proxy_point(const Eigen::Vector3f& p, const Eigen::Vector3f& direction,
                                            float inverse_distance) {
  ProxyPoint x;
  x << direction + inverse_distance * p, inverse_distance;
  return x;
}

// From a view's centre towards the proxy point; any length.
[[nodiscard]] inline Eigen::Vector3f ray_to(const ProxyPoint& x, const Eigen::Vector3f& centre) {
  return x.head<3>() - x.w() * centre;
}

// Buehler's angular penalty at the proxy point X, for a view with centre C: how far the ray from X to C passes by p,
// metres. Unlike the angle at X it stays meaningful for distant surroundings, and for one ray it orders the views
// alike.
[[nodiscard]] inline float ray_distance(const Eigen::Vector3f& p, const ProxyPoint& x, const Eigen::Vector3f& centre) {
  const Eigen::Vector3f ray = ray_to(x, centre);
  return (p - centre).cross(ray).norm() / ray.norm();
}

// Level-0 pixel (u·w, v·w, w) at which a view sees the proxy point. Visible only when w > 0.
[[nodiscard]] inline Eigen::Vector3f pixel_of(const FieldView& view, const ProxyPoint& x) {
  return view.pixel_from_world * x;
}

// The level of a view whose texels are as large as so many level-0 pixels, or just smaller: floor(log2(pixels)).
[[nodiscard]] inline int level_of_pixels(const FieldView& view, float pixels) {
  if (!(pixels > 1)) return 0;
  constexpr std::uint32_t mantissa_bits = 23, exponent_bias = 127;
  const auto level = static_cast<int>((std::bit_cast<std::uint32_t>(pixels) >> mantissa_bits) - exponent_bias);
  return std::min(level, static_cast<int>(view.levels.size()) - 1);
}
// The same for an angle seen from p. Scaled as proxy_point() makes it, X lies at distance 1/s from p, so the same patch
// seen from C subtends angle / |ray|.
[[nodiscard]] inline int level_for_angle(const FieldView& view, const ProxyPoint& x, float angle_rad) {
  return level_of_pixels(view, angle_rad / ray_to(x, view.centre_in_world).norm() * view.focal_px);
}

}  // namespace mf
