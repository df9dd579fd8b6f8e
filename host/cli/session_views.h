// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/progress.h"
#include "host/light_field/resample.h"
#include "host/team/team.h"

namespace mf {

// The captured views of a calibrated session, linearized, and the part of the light-field plane that they cover.
struct SessionViews {
  std::vector<FieldView> views;
  PlaneRectangle rectangle;
  bool absolute = false;                 // radiance is in the units of the reference reading
  std::vector<std::string> frame_names;  // of the calibration, which FieldView::frame indexes
};

// Session folder (with response.json and calibration.json) → views. Throws InputError for a folder that is no such
// session or has fewer than two used frames, and, naming the flag, for options that no light field can have.
[[nodiscard]] SessionViews load_session_views(const std::string& command, const std::filesystem::path& folder,
                                              const ResampleOptions&, const Team&, const Progress&);

}  // namespace mf
