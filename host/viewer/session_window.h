// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "host/viewer/session_view.h"
#include "host/viewer/window.h"

namespace mf {

// Shows a capture's rays until the window is closed: how many frames caught light at each point of the plane, and the
// directions of the hemisphere that a point knows (docs/viewer.md).
void show_session(Window&, SessionView, const std::string& title);

}  // namespace mf
