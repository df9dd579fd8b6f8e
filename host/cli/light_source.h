// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "common/progress.h"
#include "host/io/mesh.h"
#include "host/light_field/resample.h"
#include "host/render/incident_light.h"

namespace mf {

// A capture, focused, from which light is resampled when a picture needs it.
struct Capture {
  std::vector<FieldView> views;
  LightField focused;  // no texels
  PenaltyOptions penalty;
};
using LightSource = std::variant<LightField, Capture>;

using StageSeconds = std::map<std::string, double>;

// A light field file (.lf.exr), or a session's folder, whose views are loaded and focused. `options` are for a session;
// a file has its own. Adds "reading", or "loading" and "focusing". Throws InputError, also for options with a file.
[[nodiscard]] LightSource open_light_source(const std::string& command, const std::filesystem::path&,
                                            const ResampleOptions&, StageSeconds&, const Progress&);

[[nodiscard]] const PlaneRectangle& plane_of(const LightSource&);

// What a picture of the object needs of it. Adds "choosing" and "resampling" ("merging" for a file). It refers to a
// file's light field, which must outlive it.
[[nodiscard]] IncidentLight light_for(const LightSource&, const TriangleMesh& mesh_in_world, const LightOptions&,
                                      StageSeconds&);

}  // namespace mf
