// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/lumigraph/proxy.h"

namespace mf {

// Which points of the proxy a photo shows.
struct VisibilityOptions {
  float tolerance = 0.01F;  // of the depth, 0.0001 to 1: a point this far behind the surface that a photo sees begins
                            // to be hidden, and is hidden at twice as much
  float silhouette = 8;     // photo pixels, 0 to 64: a photo is not trusted this near to a jump of its depth, where an
                            // inexact proxy puts colours of the foreground on the background

  [[nodiscard]] std::optional<std::string> validate() const;
};

// What one photo sees of the proxy, on a grid of `step` photo pixels. Inverse depth, because that is linear in the
// picture over any plane: between texels a plane is met exactly.
struct SourceSight {
  // Upper half: inverse depth of the proxy along the optical axis, 65535 at `scale`; 0: nothing there. Lower half:
  // trust, mask times distance from silhouettes, 65535 at all of both. One word, so that one load brings both. Trust is
  // smoothed between texels, not in them: bilinear it would rise from 0 with a bend.
  using Texel = std::uint32_t;
  [[nodiscard]] static Texel texel(std::uint32_t inverse_depth, std::uint32_t trust) {
    return inverse_depth << 16U | trust;
  }
  int width = 0;
  int height = 0;
  float texels_per_px = 1;
  float scale = 0;            // inverse depth of code 65535, 1/m
  std::vector<Texel> texels;  // width · height, and some behind them, so that each has neighbours to load

  // What bounds over many texels are told from: cells of 2, 4, 8 ... texels a side, row by row, the finest level first.
  struct Cell {
    std::uint8_t least_inverse_depth = 0;  // 255 at `scale`, rounded down
    std::uint8_t largest_trust = 0;        // 255 at 1, rounded up
  };
  struct Level {
    std::int32_t width = 0;
    std::int32_t first = 0;  // of the cells
  };
  std::vector<Cell> cells;
  std::array<Level, 16> levels;  // up to pictures of 2^17 pixels

  // No place in the rectangle shows less inverse depth or more trust. Its sides are texels, from 0 to the last, and
  // what lies between them. Over a few texels the bounds are what the bilinear patches have at their corners, exact.
  struct Bounds {
    float least_inverse_depth = 0;  // 1/m
    float largest_trust = 0;        // 0…1
  };
  [[nodiscard]] Bounds bounds(float left, float top, float right, float bottom) const;

  [[nodiscard]] bool empty() const { return texels.empty(); }

 private:
  [[nodiscard]] Bounds of_cells(int x0, int y0, int x1, int y1) const;
};

// The halves of a texel. Through signed integers, which processors convert many at once.
inline float depth_code(SourceSight::Texel t) {
  return static_cast<float>(static_cast<std::int32_t>(t >> 16U));
}
inline float trust_code(SourceSight::Texel t) {
  return static_cast<float>(static_cast<std::int32_t>(t & 0xFFFFU));
}

// Empty where the photo shows everything that lies in its picture: no mask, and a proxy that hides nothing of itself
// from views (a plane; walls seen from inside).
[[nodiscard]] SourceSight make_sight(const CameraModel&, const Rigid3& cam_from_world, const ImageU8& mask,
                                     const Proxy&, const VisibilityOptions&);

// Hidden points, and those at silhouettes, keep this much weight: they speak where no photo has anything better, rather
// than leave a hole, and are out-voted hundreds to one elsewhere. Only a mask silences a photo.
inline constexpr float least_sight = 2e-5F;

}  // namespace mf
