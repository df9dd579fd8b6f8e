// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "host/light_field/distance_sweep.h"
#include "host/light_field/emitters.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/surroundings.h"
#include "host/team/team.h"

namespace mf {

// One try of the search for the best sphere.
struct SphereScore {
  double radius_m = 0;  // may be infinite
  double inconsistency =
      0;  // mean distance of log2 radiance from the median of the views that answer for one ray, stops
};

// Radii tried against each other: for rays through the rectangle, how well do the k best views agree on what they see
// on a sphere about the rectangle's centre? Sorted by radius; each is larger than the rectangle's half diagonal.
[[nodiscard]] std::vector<SphereScore> score_spheres(const std::vector<FieldView>& views, const PlaneRectangle&, int k);

// A distance per direction: for each the one at which the views agree best. Where the surroundings are featureless any
// distance serves. Directions about an emitter get the emitter's distance: it matters most, and a leaf before it hides
// it best.
[[nodiscard]] Surroundings find_surroundings(const DistanceSweep&, std::span<const Emitter>);

}  // namespace mf
