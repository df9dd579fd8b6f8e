// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/image.h"
#include "common/progress.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/calibration/calibration.h"
#include "host/light_field/light_field.h"

namespace mf {

// What a processed session's report is made of. Records only: the report measures and draws, it estimates nothing.
struct ReportInput {
  std::string title;
  const SessionReader& session;
  const ResponseCurve& response;
  const Calibration& calibration;
  const LightField& field;
  const ImageF& probe;                    // lat-long radiance at one point, three channels, top is up
  Eigen::Vector3d probe_at_in_world;      // metres
  std::map<std::string, double> seconds;  // what took how long, by stage
};

// One self-contained HTML page, UTF-8: pictures are inlined, nothing is fetched, no script. Reads on a phone and on a
// desktop. It shows sample frames with the mirror's opening, the response, the error of every frame, which directions
// were seen, how far what the light comes from is, the probe, the irradiance over the plane, and every frame that was
// not used with the reason. Throws InputError when a frame of the session cannot be read.
[[nodiscard]] std::string report_html(const ReportInput&, const Progress&);

}  // namespace mf
