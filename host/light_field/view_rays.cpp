// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/view_rays.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace mf {

std::optional<FieldProxy> parse_proxy(std::string_view text) {
  if (text == "plane") return FieldProxy{0};
  constexpr std::string_view prefix = "sphere:";
  if (!text.starts_with(prefix)) return std::nullopt;
  text.remove_prefix(prefix.size());
  if (text == "inf") return FieldProxy{std::numeric_limits<double>::infinity()};
  double radius = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), radius);
  if (error != std::errc{} || end != text.data() + text.size() || !(radius > 0) || !std::isfinite(radius))
    return std::nullopt;
  return FieldProxy{radius};
}

std::string proxy_name(const FieldProxy& proxy) {
  if (proxy.radius_m == 0) return "plane";
  return std::isinf(proxy.radius_m) ? "sphere:inf" : fmt::format("sphere:{:.3g}", proxy.radius_m);
}

float inverse_distance_to_sphere(const Eigen::Vector3f& p, const Eigen::Vector3f& direction,
                                 const Eigen::Vector3f& centre, double radius_m) {
  if (std::isinf(radius_m)) return 0;
  const Eigen::Vector3f offset = p - centre;
  const float b = offset.dot(direction), r = static_cast<float>(radius_m);
  return 1 / (-b + std::sqrt(std::max(0.0F, b * b - offset.squaredNorm() + r * r)));
}

int level_for_angle(const FieldView& view, const ProxyPoint& x, float angle_rad) {
  // Scaled as proxy_point() makes it, X lies at distance 1/s from p, so the same patch seen from C subtends angle /
  // |ray|.
  const float pixels = angle_rad / ray_to(x, view.centre_in_world).norm() * view.focal_px;
  const int level = pixels > 1 ? static_cast<int>(std::log2(pixels)) : 0;
  return std::clamp(level, 0, static_cast<int>(view.levels.size()) - 1);
}

}  // namespace mf
