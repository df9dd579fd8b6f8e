// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "host/light_field/light_field.h"
#include "host/light_field/light_tiles.h"

namespace mf {

// A field's tiles without the light that its emitters bring through their masks. `images` has one for each direction
// and refers to the field's texels, where an emitter shows to `changed`; both must outlive it.
struct DarkTiles {
  std::vector<PlaneTile> changed;
  std::vector<PlaneImage> images;

  DarkTiles() = default;
  DarkTiles(DarkTiles&&) = default;  // no copies: the images refer to the texels
  DarkTiles& operator=(DarkTiles&&) = default;
};

// Takes away what resampling has drawn: the mean over a cell, at every fourth texel's corner, linear between. What is
// left is the light beside the emitters; half floats of a lamp's texels leave it uncertain by a two-thousandth of the
// lamp, either way.
[[nodiscard]] DarkTiles tiles_without_emitters(const LightField&);

}  // namespace mf
