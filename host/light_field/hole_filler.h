// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "common/image.h"
#include "host/light_field/light_field.h"

namespace mf {

// A guess for texels that no view saw: their confidence stays 0, which marks them; only their colour is filled.
//
// What no view saw of a direction lies, as seen from the rectangle's centre, in a hole of the surroundings' panorama.
// That is closed by pull-push (Gortler, Grzeszczuk, Szeliski, Cohen 1996, §3.4.2): coarser and coarser means of what is
// known, then down again into what is not. A texel takes its cell's mean from there: so light flows from neighbouring
// directions, and from neighbouring places by their parallax. The plane proxy has no panorama: there each tile is
// closed by itself, and a direction that no view saw at all stays black.
//
// A guess is never a lamp: emitters are not in the panorama, and what is brighter than four times the median counts as
// that.
class HoleFiller {
 public:
  // Keeps a reference; the field has everything but its texels.
  explicit HoleFiller(const LightField&);

  // Fills colours of the tile's texels whose confidence is 0; returns how many.
  std::size_t fill(std::size_t direction, Eigen::Vector4f* tile) const {
    return fill(direction, field_.plane, field_.resolution, tile);
  }
  // The same for a tile of another rectangle and resolution. With a panorama, guesses for every so many texels are
  // interpolated between: a hole is closed with means, which vary slowly. Precondition: spacing ≥ 1.
  std::size_t fill(std::size_t direction, const PlaneRectangle&, int resolution, Eigen::Vector4f* tile,
                   int spacing = 1) const;

 private:
  // Of a cell in these parts, at p; both in the world.
  [[nodiscard]] Eigen::Vector3f guess(const std::vector<CellSample>& parts, const Eigen::Vector3f& p) const;

  const LightField& field_;
  Surroundings closed_;  // the panorama without holes; its weight 1 everywhere, or 0 when nothing was seen at all
};

// Closes the holes of a picture whose last of four channels is a weight (0: a hole) by pull-push. Known pixels (weight
// above 0) keep their colour; holes get weight `guess_weight`. `wraps`: the left and right edge are one.
void pull_push(ImageF& rgbw, bool wraps, float guess_weight);

}  // namespace mf
