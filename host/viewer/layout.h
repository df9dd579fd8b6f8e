// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace mf {

// A rectangle of the window, pixels from its upper left corner.
struct Box {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;

  [[nodiscard]] bool holds(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= x && pixel.y() >= y && pixel.x() < x + width && pixel.y() < y + height;
  }
  // Fractions of width and height, and back.
  [[nodiscard]] Eigen::Vector2d position_of(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - x) / width, (pixel.y() - y) / height};
  }
  [[nodiscard]] Eigen::Vector2d pixel_of(const Eigen::Vector2d& position) const {
    return {x + position.x() * width, y + position.y() * height};
  }
};

// The window is a panel of settings at the left, and pictures beside it, each below a line of text.
constexpr int panel_width_px = 320;
constexpr int caption_height_px = 24;
// The smallest window in which every picture has room.
constexpr int smallest_window_width_px = 640;
constexpr int smallest_window_height_px = 400;

// The four pictures of a light field: plane, hemisphere, distances, panorama.
struct LightFieldLayout {
  Box plane;  // keeps the rectangle's aspect
  Box hemisphere;
  Box distances;
  Box panorama;  // twice as wide as high
};
// `plane_aspect`: the rectangle's width over its height.
[[nodiscard]] LightFieldLayout light_field_layout(int window_width, int window_height, double plane_aspect);

// The largest box of that aspect (width over height) within `room`, in its middle.
[[nodiscard]] Box fitted(const Box& room, double aspect);

// Everything right of the panel.
[[nodiscard]] Box picture_room(int window_width, int window_height);

}  // namespace mf
