// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "device/camera_features.h"

namespace mf {

struct SteadySettings {
  std::vector<FeatureReading> readings;
  std::vector<std::string> remarks;
};

// Switches off what would change a recording while it runs, or bend its response: automatic exposure, gain, black
// level and white balance, gamma, look-up tables, exposures that differ from frame to frame. What the camera does not
// have is passed over; what it refuses is a remark, one line each. Never throws.
[[nodiscard]] SteadySettings hold_steady(FeatureAccess&);

}  // namespace mf
