// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "common/progress.h"
#include "host/light_field/surroundings.h"
#include "host/lumigraph/posed_photo.h"
#include "host/lumigraph/proxy.h"

namespace mf {

// The mirror frames of a session folder (with calibration.json, and response.json unless its frames are linear) at
// `scale` of their size, and the scene pictures if `scene`. Throws InputError.
[[nodiscard]] PhotoSet read_session_photos(const std::filesystem::path& folder, double scale, bool scene,
                                           const Progress&);

// What a session's rays come from, by name: "auto" finds a distance per direction as resample does; NAME.lf.exr takes
// what a light field was focused on; else as make_proxy(), a mesh as walls about the views. A session's masks are the
// mirror's opening, no silhouettes: "hull" is refused. Throws InputError.
[[nodiscard]] Proxy session_proxy(const std::string& name, const PhotoSet&, const std::filesystem::path& folder,
                                  const Progress&);

// Surroundings as walls about the views, a vertex a degree, down to the horizon: views from behind the mirror
// look up through the open side. What is more than 50 m away is drawn there. Precondition: not the plane.
[[nodiscard]] TriangleMesh mesh_of(const Surroundings&);

}  // namespace mf
