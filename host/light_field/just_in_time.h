// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "host/blending/ray_penalty.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_tiles.h"

namespace mf {

struct JustInTimeOptions {
  // A tile is as fine as the light field's, but has no more than this many texels along a side (more only where they
  // would be larger than 5 cm). What comes from far off varies slowly over the plane, and small bright sources are left
  // out: so a preview needs few. A multiple of 8, at least 8.
  int most_texels = 8;
  // Takes less care of what a mean over many cells hides: a cell is fetched from a view in 6 parts instead of the 12 of
  // a light field's tile, and of what no view saw every fourth texel is guessed. It costs two thirds of the time.
  bool rough = false;
};

// The light of some cells over some parts of the plane, straight from the views: what merged_tiles makes of the whole
// light field's tiles_without_emitters, without the rest of it (Ihrke et al. 2008, future work). `focused` is a light
// field without texels (Resampling::field). What no view saw is guessed (hole_filler.h).
//
// The tiles reach at least over the requests' rectangles, and no farther than the light field's, which a request
// beyond it is moved to: there the rim's value holds on. With the plane as proxy they are over all of it: few texels
// of everything cost no more there.
[[nodiscard]] std::vector<PlaneTile> resample_just_in_time(const std::vector<FieldView>& views,
                                                           const LightField& focused, const PenaltyOptions&,
                                                           std::span<const TileRequest>, const JustInTimeOptions&);

}  // namespace mf
