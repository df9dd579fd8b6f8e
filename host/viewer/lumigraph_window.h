// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "host/viewer/lumigraph_view.h"
#include "host/viewer/window.h"

namespace mf {

// Shows a lumigraph until the window is closed: moved by pointer and keys, as photos or as the blending field, with the
// photos that speak under the pointer, and a camera path to record and to render (docs/viewer.md).
struct LumigraphWindowOptions {
  std::string title;                  // a line of text about the photos
  std::filesystem::path path_folder;  // where a recorded path and its frames are written
};
void show_lumigraph(Window&, LumigraphView, const LumigraphWindowOptions&);

}  // namespace mf
