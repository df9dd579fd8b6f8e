// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "host/light_field/emitter_blender.h"
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

// A distance per direction by photo-consistency: a plane sweep over inverse distance (Collins 1996) in which all views
// that see a point vote. The cost is the robust spread of their absolute log radiance (the capture is radiometrically
// calibrated: nothing is normalized), smoothed over neighbouring directions; where the surroundings are featureless any
// distance serves.
// Directions about an emitter get the emitter's distance: it matters most, and a leaf before it hides it best.
[[nodiscard]] Surroundings find_surroundings(const std::vector<FieldView>& views, const PlaneRectangle&,
                                             std::span<const Emitter>, const Team& = {});

// World position of the rectangle's centre.
[[nodiscard]] Eigen::Vector3f centre_of(const PlaneRectangle&);

}  // namespace mf
