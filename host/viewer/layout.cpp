// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/layout.h"

#include <algorithm>
#include <cmath>

namespace mf {

namespace {

constexpr int margin_px = 8;

// One of 2 × 2 places for a picture, below its caption.
Box quarter(const Box& room, int column, int row) {
  const int width = room.width / 2, height = room.height / 2;
  return {room.x + column * width, room.y + row * height + caption_height_px, width - margin_px,
          height - caption_height_px - margin_px};
}

}  // namespace

Box fitted(const Box& room, double aspect) {
  const int width = std::max(1, std::min(room.width, static_cast<int>(std::lround(room.height * aspect))));
  const int height = std::max(1, std::min(room.height, static_cast<int>(std::lround(width / aspect))));
  return {room.x + (room.width - width) / 2, room.y + (room.height - height) / 2, width, height};
}

Box picture_room(int window_width, int window_height) {
  return {panel_width_px + margin_px, 0, std::max(window_width - panel_width_px - margin_px, 2),
          std::max(window_height, 2)};
}

LightFieldLayout light_field_layout(int window_width, int window_height, double plane_aspect) {
  const Box room = picture_room(window_width, window_height);
  return {fitted(quarter(room, 0, 0), plane_aspect), fitted(quarter(room, 1, 0), 1), fitted(quarter(room, 0, 1), 1),
          fitted(quarter(room, 1, 1), 2)};
}

}  // namespace mf
