// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/progress.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/photometry/response_estimate.h"

namespace mf {

struct PhotometryOptions {
  ResponseOptions response;
  bool linear = false;  // take the sensor as linear between the black level given and its last code; use no sweep

  [[nodiscard]] std::optional<std::string> validate() const { return response.validate(); }
};

struct PhotometryResult {
  ResponseCurve curve;
  std::vector<ChannelReport> channels;    // empty unless a sweep was used
  std::vector<std::string> sweep_frames;  // names, in the order of SelfConsistency::frame_mean
};

// A session's response curve, and its absolute scale when the session has a spot-meter reading. Linear-float sessions
// get the identity. Throws InputError when there is no sweep (and linear was not asked for), or it cannot tell.
[[nodiscard]] PhotometryResult photometry(const SessionReader&, const PhotometryOptions&, const Progress& = {});

// The content of response.json: the curve, and the options that made it.
[[nodiscard]] nlohmann::json response_json(const PhotometryResult&, const PhotometryOptions&);

// What was measured, for machines and for people.
[[nodiscard]] nlohmann::json photometry_summary(const PhotometryResult&);
[[nodiscard]] std::string photometry_text(const PhotometryResult&);

}  // namespace mf
