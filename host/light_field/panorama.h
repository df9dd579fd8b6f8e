// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "common/image.h"
#include "host/light_field/emitter_blender.h"
#include "host/light_field/field_views.h"
#include "host/light_field/surroundings.h"
#include "host/team/team.h"

namespace mf {

// The surroundings' panorama as the rectangle's centre sees it, blended from the views that pass nearest to it.
// `width` × `width`/4 pixels.
[[nodiscard]] ImageF make_panorama(const std::vector<FieldView>& views, const Surroundings&, const EmitterBlender&,
                                   int width, const Team&);

}  // namespace mf
