// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "host/light_field/field_views.h"
#include "host/light_field/shaded_emitter.h"

namespace mf {

// The emitter with the place and size of its whole outline, as the views together show it. `start`: triangulated from
// what single views saw, of which leaves hide a part; within a quarter of its radius of the true centre or so, and of
// half to one and a half times the true radius.
//
// What hides a part of a lamp hides different parts from different places, and never makes it brighter: at each offset
// from the centre, across the line of sight, the brighter views tell what the lamp itself shows there. The outline is
// where that falls to half. The radius is that of a ball of the outline's area. Returns `start` when too few views
// look.
[[nodiscard]] Emitter fit_outline(const std::vector<FieldView>& views, const Emitter& start);

}  // namespace mf
