// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/response_curve.h"
#include "common/session.h"
#include "host/calibration/calibration.h"

namespace mf {

// What earlier commands left in a session's folder. Both throw InputError that names the command to run first.
// Linear-float frames need no response.json: they are proportional to light already.
[[nodiscard]] ResponseCurve response_of(const SessionReader&);
[[nodiscard]] Calibration calibration_of(const SessionReader&);

}  // namespace mf
