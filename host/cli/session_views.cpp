// SPDX-License-Identifier: Apache-2.0
#include "host/cli/session_views.h"

#include "common/error.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/cli/session_files.h"

namespace mf {

SessionViews load_session_views(const std::string& command, const std::filesystem::path& folder,
                                const ResampleOptions& options, const Team& team, const Progress& progress) {
  if (const auto problem = options.validate())
    throw InputError(command, "--" + problem->substr(0, problem->find(':')), problem->substr(problem->find(':') + 2));
  const SessionReader session = open_session(folder);
  const ResponseCurve response = response_of(session);
  const Calibration calibration = calibration_of(session);
  std::optional<PlaneRectangle> rectangle;
  if (options.rectangle) {
    const auto& r = *options.rectangle;
    rectangle = PlaneRectangle{{Eigen::Quaterniond::Identity(), {0, 0, options.height_m}}, {r[0], r[1]}, {r[2], r[3]}};
  } else {
    rectangle = covered_rectangle(calibration, session.header().target, options.height_m);
  }
  if (!rectangle)
    throw InputError((folder / "calibration.json").string(), "frames",
                     "no mirror view looks through the plane at this --height: lower it, or give --rectangle");
  std::vector<std::string> names;
  for (const MirrorPose& pose : calibration.frames) names.push_back(pose.name);
  return {load_field_views(session, response, calibration, team, progress), *rectangle, response.absolute,
          std::move(names)};
}

}  // namespace mf
