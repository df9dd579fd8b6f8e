// SPDX-License-Identifier: Apache-2.0
#include "device/tag_follower.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/check.h"

namespace mf {

namespace {

constexpr int tile_px = 8;              // AprilTag's threshold tiles of 4 pixels, decimated by 2
constexpr double least_margin_px = 24;  // a tag needs its white border, and a slow hand still trembles

int down_to_tile(double v) {
  return static_cast<int>(std::floor(v / tile_px)) * tile_px;
}

}  // namespace

TagFollower::TagFollower(TagFollowerOptions options) : options_(std::move(options)) {
  check(options_.full_each >= 1, "some searches are full");
}

std::optional<TagFollower::Place> TagFollower::place_of(std::span<const TagDetection> tags) const {
  Place place{Eigen::Vector2d::Constant(1e9), Eigen::Vector2d::Constant(-1e9), 0};
  for (const TagDetection& tag : tags) {
    if (std::find(options_.ids.begin(), options_.ids.end(), tag.id) == options_.ids.end()) continue;
    for (const Eigen::Vector2d& corner : tag.corners_px) {
      place.low = place.low.cwiseMin(corner);
      place.high = place.high.cwiseMax(corner);
    }
    ++place.tags;
  }
  return place.tags > 0 ? std::optional(place) : std::nullopt;
}

PixelBox TagFollower::next(int width, int height) const {
  const PixelBox whole{0, 0, width, height};
  if (!last_ || since_full_ + 1 >= options_.full_each) return whole;
  const Eigen::Vector2d size = last_->high - last_->low;
  const Eigen::Vector2d margin = (options_.margin * size + 1.5 * step_.cwiseAbs()).cwiseMax(least_margin_px);
  const Eigen::Vector2d low = last_->low - margin, high = last_->high + margin;
  const int x0 = std::clamp(down_to_tile(low.x()), 0, width), y0 = std::clamp(down_to_tile(low.y()), 0, height);
  const int x1 = std::clamp(down_to_tile(high.x()) + tile_px, 0, width);
  const int y1 = std::clamp(down_to_tile(high.y()) + tile_px, 0, height);
  const PixelBox box{x0, y0, x1 - x0, y1 - y0};
  constexpr double worth_it = 0.8;  // of the whole frame; a larger box saves nothing
  const bool small = static_cast<double>(box.width) * box.height < worth_it * width * height;
  return small && box.width > 0 && box.height > 0 ? box : whole;
}

bool TagFollower::accept(const PixelBox& box, const PixelBox& frame, std::span<const TagDetection> tags) {
  const std::optional<Place> place = place_of(tags);
  const bool full = box == frame;
  if (!full && (!place || place->tags < options_.enough_tags * tags_in_full_)) return false;
  if (place && last_)
    step_ = 0.5 * ((place->low + place->high) - (last_->low + last_->high));
  else
    step_.setZero();
  last_ = place;
  since_full_ = full ? 0 : since_full_ + 1;
  if (full) tags_in_full_ = place ? place->tags : 0;
  return true;
}

}  // namespace mf
