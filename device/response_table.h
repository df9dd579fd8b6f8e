// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/frame.h"
#include "common/sensor_response.h"
#include "device/camera_features.h"

// Programmable response by an ordered table: for each way in which cameras offer it, the features' names (and their
// other names), units and scales. docs/response.md shows the table. Nothing here knows of Aravis or V4L2.

namespace mf {

enum class ResponseKind { multi_slope, lin_log, wide_dynamic_range, linear };

// The first row of the table that the camera has.
struct ResponseCapability {
  ResponseKind kind = ResponseKind::linear;
  std::string scheme = "linear";      // the row's name: "SFNC MultiSlope" ...
  int most_knees = 0;                 // multi-slope: how many may be asked for
  std::vector<std::string> features;  // of that row, which are there now, by the camera's names
};
// Only reads; never throws.
[[nodiscard]] ResponseCapability probe_response(const FeatureAccess&);

// The camera merges exposures by itself, and tells nobody the curve.
struct WideDynamicRange {
  [[nodiscard]] bool operator==(const WideDynamicRange&) const = default;
};
using ResponseRequest = std::variant<LinearSensor, MultiSlopeSensor, LinLogSensor, WideDynamicRange>;

struct UnknownResponse {
  std::string why;  // one line
};

// What is in force, from what was read back.
struct ResponseSetting {
  std::string scheme = "linear";
  std::variant<LinearSensor, MultiSlopeSensor, LinLogSensor, UnknownResponse> in_force;
  std::vector<FeatureReading> readings;  // all of the row's features; "MultiSlopeExposureLimit[2]" is that of knee 2
  std::vector<std::string> remarks;      // one line each: what was refused, changed by the camera, or is not there
};

// Writes the request (nothing: leaves the camera as it is) and reads everything back. A refused, clipped or missing
// feature is a remark, and in_force is what the camera then says. `exposure_s`: some cameras give knees as times.
// Throws InputError when the camera has no such response at all, or the request is no sensor's (fault_of()).
[[nodiscard]] ResponseSetting apply_response(FeatureAccess&, const std::optional<ResponseRequest>&, double exposure_s);

// The curve of what is in force; relative exposure 1 fills a linear pixel. Nothing when nobody knows it.
[[nodiscard]] std::optional<ResponseCurve> response_curve_of(const ResponseSetting&, const PixelFormat&,
                                                             double black_level);
// The same, or a straight line where nobody knows: good enough to look for tags, not to measure light.
[[nodiscard]] ResponseCurve approximate_response_curve(const ResponseSetting&, const PixelFormat&, double black_level);

// For the session's documents.
[[nodiscard]] nlohmann::json to_json(const ResponseSetting&);
[[nodiscard]] nlohmann::json to_json(const std::vector<FeatureReading>&);

}  // namespace mf
