// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "common/image.h"
#include "host/light_field/light_field.h"

namespace mf {

// What the light comes from, as the plane's middle sees it: the proxy's distance by direction in false colours, near
// yellow, far violet, evenly in inverse distance. Drawn as draw_hemisphere() does.
struct DistanceDisc {
  ImageU8 colours;       // three channels; white outside the disc, greyer where the distance is less sure
  double nearest_m = 0;  // the distance that yellow stands for; violet is infinity
};
// Precondition: the field has surroundings (not the plane proxy).
[[nodiscard]] DistanceDisc draw_distances(const LightField&, int size_px);

// The disc as inline SVG: emitters as numbered rings where the plane's middle sees them, and a scale in metres.
[[nodiscard]] std::string distance_figure(const LightField&, int size_px);

// The emitters as an HTML table; empty without any.
[[nodiscard]] std::string emitter_table(const LightField&);

}  // namespace mf
