// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "device/lookout.h"

namespace mf {

// What looking at a recording again found.
struct ReplayResult {
  int frames = 0;     // of the mirror
  int with_tags = 0;  // of them
  int posed = 0;
  double median_tags = 0;           // of the mirror and the world, in frames that have some
  double median_ms = 0;             // to find them
  std::optional<double> covered;    // of the light; nothing when no pose or no world was known
  std::vector<std::string> damage;  // SessionReader::damage()
};

// Tags and pose of one frame, as they were found.
struct ReplayedFrame {
  const SessionFrame* frame = nullptr;
  const DetectedFrame* detected = nullptr;
  bool posed = false;
};

// Detection, pose and coverage as the rig has them while it records, over every mirror frame of a session, none left
// out. The response is the session's own (response.json); without one the sensor counts as linear. Writes nothing.
// Throws InputError.
[[nodiscard]] ReplayResult replay(const std::filesystem::path& session, const LookoutOptions&,
                                  const std::function<void(const ReplayedFrame&)>& each = {});

}  // namespace mf
