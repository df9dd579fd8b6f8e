// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/response_curve.h"
#include "common/session.h"
#include "host/calibration/calibration.h"

namespace mf {

// Opens a session, and says on standard error what its index has lost: what is left is worked on. Throws InputError.
[[nodiscard]] SessionReader open_session(const std::filesystem::path& folder);

// What earlier commands left in a session's folder. Both throw InputError that names the command to run first.
// Linear-float frames need no response.json: they are proportional to light already.
[[nodiscard]] ResponseCurve response_of(const SessionReader&);
[[nodiscard]] Calibration calibration_of(const SessionReader&);

}  // namespace mf
