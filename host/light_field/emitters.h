// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/light_field/field_views.h"

namespace mf {

// A small bright source that several views saw from different places: a lamp. World frame.
struct Emitter {
  Eigen::Vector3f position;
  float radius_m = 0;  // of a ball of the solid angle under which it appears
  int views = 0;       // that agree on it
};

struct EmitterOptions {
  float brightness = 30;           // times the views' mean radiance: what counts as bright
  float largest_angle_rad = 0.3F;  // across; larger bright areas (windows, skies) are no small sources
  float tolerance_rad =
      0.012F;            // by which rays may miss the source: half a small lamp, as a leaf before it may hide a side
  int fewest_views = 6;  // that must agree
  float farthest_m = 8;  // beyond, the surroundings' own distance is as good
};

// Bright spots of the views, triangulated: the ray through each spot's centroid votes, pairs of rays propose positions
// (RANSAC), the position with most votes is refined by least squares over its voters, and the next is looked for among
// the rest. Brightest first is not guaranteed; most votes first is.
[[nodiscard]] std::vector<Emitter> find_emitters(const std::vector<FieldView>& views, const EmitterOptions& = {});

}  // namespace mf
