// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "host/viewer/light_field_view.h"
#include "host/viewer/window.h"

namespace mf {

// Shows a light field until the window is closed: the plane's irradiance, on which the probe point is dragged, and what
// the point sees: the hemisphere, the distances of the surroundings, the panorama (docs/viewer.md). `title` is the
// window's line of text about the field.
void show_light_field(Window&, LightFieldView&, const std::string& title);

}  // namespace mf
