// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "host/light_field/field_views.h"
#include "host/light_field/shaded_emitter.h"

namespace mf {

// The emitter with its centre where the smallest ball has it that the bright rays of all views meet.
//
//   centre = argmin Σ dist(centre, ray)^8      over the rays of pixels at least half as bright as the emitter
//
// What hides parts of it takes other rays away in other views, and shifts every view's centroid; but no bright ray
// misses the ball, and as long as each side of it is seen from somewhere, the rays at its rim hold the centre from all
// sides, along the line of sight too, which an outline across it cannot. A high power counts nearly only the rim; a
// maximum would count a single noisy pixel. `start`: within half its radius or so. Returned unchanged when too few
// views look or the centre runs off.
[[nodiscard]] Emitter centred_on_rays(const std::vector<FieldView>& views, const Emitter& start);

}  // namespace mf
