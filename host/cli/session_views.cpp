// SPDX-License-Identifier: Apache-2.0
#include "host/cli/session_views.h"

#include <algorithm>

#include "common/error.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/cli/session_files.h"

namespace mf {

namespace {

// As the user typed it: a letter has one dash.
std::string flag_of(const std::string& field) {
  return (field.size() == 1 ? "-" : "--") + field;
}

}  // namespace

SessionViews load_session_views(const std::string& command, const std::filesystem::path& folder,
                                const ResampleOptions& options, const Team& team, const Progress& progress) {
  if (const auto problem = options.validate()) {
    const std::size_t colon = problem->find(':');
    throw InputError(command, flag_of(problem->substr(0, colon)), problem->substr(colon + 2));
  }
  const SessionReader session = open_session(folder);
  const ResponseCurve response = response_of(session);
  const Calibration calibration = calibration_of(session);
  const std::string file = (folder / "calibration.json").string();
  const PlaneRectangle rectangle =
      chosen_rectangle(calibration, session.header().target, options.height_m, options.rectangle, file);
  const auto is_used = [](const MirrorPose& pose) { return pose.used; };
  if (std::count_if(calibration.frames.begin(), calibration.frames.end(), is_used) < 2)
    throw InputError(file, "frames",
                     "has one used frame only, which is no light field: calibrate again, or record more");
  std::vector<std::string> names;
  for (const MirrorPose& pose : calibration.frames) names.push_back(pose.name);
  return {load_field_views(session, response, calibration, team, progress), rectangle, response.absolute,
          std::move(names)};
}

}  // namespace mf
