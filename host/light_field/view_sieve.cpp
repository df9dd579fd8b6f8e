// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/view_sieve.h"

#include <algorithm>
#include <array>
#include <limits>

#include "host/blending/vectorized.h"

namespace mf {

namespace {

constexpr std::size_t chunk = 64;

// Of `chunk` views or less.
struct Pictures {
  std::array<const float*, 12> m;
  const float *width, *height, *focal_px;
  std::size_t count;
};

// A level's texel is at most angle · focal / |ray| pixels large and w ≤ |ray|, so with both sides times w the reach of
// an interpolation, one and a half texels, is a constant. One pixel more serves the finest level.
MF_VECTORIZED void mark_pictures(const Pictures& v, const float* x, float angle_rad, int* shows) {
  for (std::size_t i = 0; i < v.count; ++i) {
    const float u = v.m[0][i] * x[0] + v.m[1][i] * x[1] + v.m[2][i] * x[2] + v.m[3][i] * x[3];
    const float t = v.m[4][i] * x[0] + v.m[5][i] * x[1] + v.m[6][i] * x[2] + v.m[7][i] * x[3];
    const float w = v.m[8][i] * x[0] + v.m[9][i] * x[1] + v.m[10][i] * x[2] + v.m[11][i] * x[3];
    const float reach = 2 * angle_rad * v.focal_px[i] + w;
    const int before = static_cast<int>(w > 0) & static_cast<int>(u > -reach) & static_cast<int>(t > -reach);
    shows[i] = before & static_cast<int>(u < v.width[i] * w + reach) & static_cast<int>(t < v.height[i] * w + reach);
  }
}

// The box about a patch's outline in each picture.
struct Boxes {
  using Side = std::array<float, chunk>;
  Side left, right, top, bottom;
  std::array<int, chunk> behind;  // some of the outline
};

MF_VECTORIZED void add_to_boxes(const Pictures& v, const float* x, Boxes& boxes) {
  for (std::size_t i = 0; i < v.count; ++i) {
    const float u = v.m[0][i] * x[0] + v.m[1][i] * x[1] + v.m[2][i] * x[2] + v.m[3][i] * x[3];
    const float t = v.m[4][i] * x[0] + v.m[5][i] * x[1] + v.m[6][i] * x[2] + v.m[7][i] * x[3];
    const float w = v.m[8][i] * x[0] + v.m[9][i] * x[1] + v.m[10][i] * x[2] + v.m[11][i] * x[3];
    const float inverse = 1 / w;
    boxes.behind[i] |= static_cast<int>(w <= 0);
    boxes.left[i] = std::min(boxes.left[i], u * inverse);
    boxes.right[i] = std::max(boxes.right[i], u * inverse);
    boxes.top[i] = std::min(boxes.top[i], t * inverse);
    boxes.bottom[i] = std::max(boxes.bottom[i], t * inverse);
  }
}

MF_VECTORIZED void mark_boxes(const Pictures& v, const Boxes& b, float margin, float angle_rad, int* shows) {
  for (std::size_t i = 0; i < v.count; ++i) {
    const float patch = 2 * angle_rad * v.focal_px[i];
    const float aside = margin * (b.right[i] - b.left[i]) + patch, beyond = margin * (b.bottom[i] - b.top[i]) + patch;
    const int before = static_cast<int>(b.right[i] > -aside) & static_cast<int>(b.bottom[i] > -beyond);
    const int within =
        static_cast<int>(b.left[i] < v.width[i] + aside) & static_cast<int>(b.top[i] < v.height[i] + beyond);
    shows[i] = b.behind[i] | (before & within);
  }
}

Pictures pictures_of(const std::vector<std::vector<float>>& pixel_from_world, std::span<const float> width,
                     std::span<const float> height, std::span<const float> focal_px, std::size_t begin) {
  Pictures pictures{{}, &width[begin], &height[begin], &focal_px[begin], std::min(chunk, width.size() - begin)};
  for (std::size_t i = 0; i < pictures.m.size(); ++i) pictures.m[i] = &pixel_from_world[i][begin];
  return pictures;
}

void add_marked(const std::array<int, chunk>& shows, std::size_t begin, std::size_t count,
                std::vector<std::uint32_t>& found) {
  for (std::size_t i = 0; i < count; ++i)
    if (shows[i] != 0) found.push_back(static_cast<std::uint32_t>(begin + i));
}

}  // namespace

ViewSieve::ViewSieve(const std::vector<FieldView>& views) : pixel_from_world_(12) {
  for (const FieldView& view : views) {
    for (int i = 0; i < 12; ++i)
      pixel_from_world_[static_cast<std::size_t>(i)].push_back(view.pixel_from_world(i / 4, i % 4));
    width_.push_back(static_cast<float>(view.levels.front().width()));
    height_.push_back(static_cast<float>(view.levels.front().height()));
    focal_px_.push_back(view.focal_px);
  }
}

void ViewSieve::find(const ProxyPoint& x, float angle_rad, std::vector<std::uint32_t>& found) const {
  found.clear();
  std::array<int, chunk> shows;
  for (std::size_t begin = 0; begin < width_.size(); begin += chunk) {
    const Pictures pictures = pictures_of(pixel_from_world_, width_, height_, focal_px_, begin);
    mark_pictures(pictures, x.data(), angle_rad, shows.data());
    add_marked(shows, begin, pictures.count, found);
  }
}

void ViewSieve::find(std::span<const ProxyPoint> outline, float margin, float angle_rad,
                     std::vector<std::uint32_t>& found) const {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  found.clear();
  std::array<int, chunk> shows;
  Boxes boxes;
  for (std::size_t begin = 0; begin < width_.size(); begin += chunk) {
    const Pictures pictures = pictures_of(pixel_from_world_, width_, height_, focal_px_, begin);
    boxes.left.fill(infinity);
    boxes.right.fill(-infinity);
    boxes.top.fill(infinity);
    boxes.bottom.fill(-infinity);
    boxes.behind.fill(0);
    for (const ProxyPoint& x : outline) add_to_boxes(pictures, x.data(), boxes);
    mark_boxes(pictures, boxes, margin, angle_rad, shows.data());
    add_marked(shows, begin, pictures.count, found);
  }
}

}  // namespace mf
