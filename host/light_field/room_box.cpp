// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/room_box.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace mf {

namespace {

constexpr float least_gap_m = 0.02F;

constexpr std::string_view box_prefix = "box:";

}  // namespace

float RoomBox::inverse_distance_along(const Eigen::Vector3f& p, const Eigen::Vector3f& d) const {
  float inverse = 0;
  for (Eigen::Index i = 0; i < 2; ++i) {
    const float gap = d[i] > 0 ? high[i] - p[i] : p[i] - low[i];
    inverse = std::max(inverse, std::abs(d[i]) / std::max(gap, least_gap_m));
  }
  if (d.z() > 0) inverse = std::max(inverse, d.z() / std::max(ceiling - p.z(), least_gap_m));
  return inverse;
}

bool RoomBox::holds(const Eigen::Vector3f& p) const {
  const Eigen::Vector2f xy = p.head<2>();
  return ((xy - low).array() >= least_gap_m).all() && ((high - xy).array() >= least_gap_m).all() &&
         ceiling - p.z() >= least_gap_m;
}

std::string box_name(const RoomBox& box) {
  return fmt::format("{}{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}", box_prefix, box.low.x(), box.low.y(), box.high.x(),
                     box.high.y(), box.ceiling);
}

std::optional<RoomBox> parse_box(std::string_view text) {
  if (!text.starts_with(box_prefix)) return std::nullopt;
  text.remove_prefix(box_prefix.size());
  std::array<float, 5> sides{};
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), sides[i]);
    if (error != std::errc{} || std::isnan(sides[i])) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (i + 1 == sides.size()) break;
    if (!text.starts_with(',')) return std::nullopt;
    text.remove_prefix(1);
  }
  const RoomBox box{{sides[0], sides[1]}, {sides[2], sides[3]}, sides[4]};
  if (!text.empty() || !(box.low.array() < box.high.array()).all()) return std::nullopt;
  return box;
}

}  // namespace mf
