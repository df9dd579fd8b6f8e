// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/shaded_emitter.h"
#include "host/team/team.h"

namespace mf {

// Draws what hides the emitter from the rectangle: sets occluder_share and the mask. Radiance is set already.
//
// A point q between plane and emitter either hides the emitter or not, whatever the view: of all views' rays through q
// those that meet the emitter must agree. At the wrong distance an occluder's edge makes them differ. So along each
// line from the emitter's centre to the plane the distance is chosen at which, in a window about it, the views disagree
// least: a plane sweep, one distance for each leaf.
void draw_occluders(const std::vector<FieldView>& views, const PlaneRectangle&, const Team&, ShadedEmitter&);

}  // namespace mf
