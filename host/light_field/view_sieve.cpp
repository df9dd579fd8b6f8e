// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/view_sieve.h"

#include <algorithm>
#include <array>

#include "host/blending/vectorized.h"

namespace mf {

namespace {

constexpr std::size_t chunk = 64;

struct Pictures {
  std::array<const float*, 12> m;
  const float *width, *height, *focal_px;
};

// A level's texel is at most angle · focal / |ray| pixels large and w ≤ |ray|, so with both sides times w the reach of
// an interpolation, one and a half texels, is a constant. One pixel more serves the finest level.
MF_VECTORIZED void mark_pictures(const Pictures& v, const float* x, float angle_rad, std::size_t n, int* shows) {
  for (std::size_t i = 0; i < n; ++i) {
    const float u = v.m[0][i] * x[0] + v.m[1][i] * x[1] + v.m[2][i] * x[2] + v.m[3][i] * x[3];
    const float t = v.m[4][i] * x[0] + v.m[5][i] * x[1] + v.m[6][i] * x[2] + v.m[7][i] * x[3];
    const float w = v.m[8][i] * x[0] + v.m[9][i] * x[1] + v.m[10][i] * x[2] + v.m[11][i] * x[3];
    const float reach = 2 * angle_rad * v.focal_px[i] + w;
    const int before = static_cast<int>(w > 0) & static_cast<int>(u > -reach) & static_cast<int>(t > -reach);
    shows[i] = before & static_cast<int>(u < v.width[i] * w + reach) & static_cast<int>(t < v.height[i] * w + reach);
  }
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
    const std::size_t n = std::min(chunk, width_.size() - begin);
    Pictures pictures{{}, &width_[begin], &height_[begin], &focal_px_[begin]};
    for (std::size_t i = 0; i < pictures.m.size(); ++i) pictures.m[i] = &pixel_from_world_[i][begin];
    mark_pictures(pictures, x.data(), angle_rad, n, shows.data());
    for (std::size_t i = 0; i < n; ++i)
      if (shows[i] != 0) found.push_back(static_cast<std::uint32_t>(begin + i));
  }
}

}  // namespace mf
