// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "host/io/mesh.h"
#include "host/light_field/light_field.h"
#include "host/light_field/light_tiles.h"
#include "host/render/light_set.h"

namespace mf {

// A field's emitters as lights at their place: what tiles_without_emitters leaves out.
struct EmitterLights {
  std::vector<PlaneTile> tiles;      // an image for each point
  std::vector<EmitterPoint> points;  // with the number of its tile
};

// `points` of each emitter, spread evenly over the disc as which the middle of the object's box sees it. Their images
// are as fine as the emitter's mask, over all of it when the plane is asked for, else where lines from the box to the
// emitter cross the plane. Precondition: points ≥ 1.
[[nodiscard]] EmitterLights emitter_lights(const LightField&, const Bounds& object_in_plane, bool plane, int points);

// Adds them to the set, which then refers to their tiles' texels.
void append_emitters(LightSet&, const EmitterLights&);

}  // namespace mf
