// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "device/camera_features.h"

namespace mf {

// What a camera says of its clock's synchronization by IEEE 1588 (PTP).
struct PtpReport {
  bool available = false;
  bool enabled = false;
  std::string status;               // as the camera names it: Slave, Master, Listening ...; empty: not told
  std::optional<double> offset_ns;  // from its master, where the camera tells it
  std::vector<FeatureReading> readings;
  std::vector<std::string> remarks;  // one line each: what was refused or cannot be read
};

// By SFNC's Ptp*, GigE Vision's older GevIEEE1588*, or Allied Vision's PtpMode. Never throws.
[[nodiscard]] PtpReport read_ptp(FeatureAccess&);
// Switches it on or off, and reports. A camera without it only reports.
[[nodiscard]] PtpReport set_ptp(FeatureAccess&, bool enabled);

}  // namespace mf
