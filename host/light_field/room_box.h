// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace mf {

// A room: four walls along the world's axes and a ceiling, metres. A side at infinity is no wall. It has no floor:
// light from below the plane is not in the field.
struct RoomBox {
  static constexpr float none = std::numeric_limits<float>::infinity();

  Eigen::Vector2f low{-none, -none};  // world x and y of the walls
  Eigen::Vector2f high{none, none};
  float ceiling = none;  // world z

  // 1 / distance from p to where the ray from p towards `direction` (world, unit) meets the room; 0 where no side lies
  // that way. The nearest of the planes ahead is met first: the largest ω_i / (side_i − p_i). A point outside of a wall
  // counts as 2 cm before it.
  [[nodiscard]] float inverse_distance_along(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const;

  // Whether p lies inside, at least 2 cm from every side.
  [[nodiscard]] bool holds(const Eigen::Vector3f& p) const;
};

// "box:-2,-1.5,3,1.5,2.4": x0, y0, x1, y1 of the walls and the ceiling's height, world metres; any may be inf or -inf.
[[nodiscard]] std::string box_name(const RoomBox&);

// Its inverse. Nothing for anything else, or when x0 < x1 or y0 < y1 does not hold.
[[nodiscard]] std::optional<RoomBox> parse_box(std::string_view);

}  // namespace mf
