// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "device/camera_source.h"
#include "device/lookout.h"
#include "device/machine_check.h"
#include "device/metering.h"
#include "device/operator_config.h"
#include "device/recorder.h"
#include "device/status_config.h"

namespace mf {

// mirrorfieldd.toml (docs/rig.md): what the rig is and how it records.
struct DeviceConfig {
  CameraSettings camera;
  std::filesystem::path target;                // target.json of the mirror in use
  std::optional<std::filesystem::path> world;  // world.json of the scene's tags
  double mirror_reflectance = 1;               // (0, 1]
  double black_level_hint = 0;                 // code
  std::filesystem::path recordings;            // sessions are made below it
  RecorderOptions recorder;
  std::optional<MeteringOptions> metering;  // nothing: exposure and response stay as [camera] and [response] say
  std::optional<LookoutOptions> lookout;    // nothing: frames are recorded unseen
  OperatorConfig operating;
  StatusConfig status;
};

// Throws InputError naming the file and the key: no TOML, an unknown key, a wrong type or range, a missing one.
// Relative paths are relative to the file's folder.
[[nodiscard]] DeviceConfig read_device_config(const std::filesystem::path&);

// What `mirrorfieldd --check` looks at for this rig.
[[nodiscard]] MachineCheckOptions machine_check_options(const DeviceConfig&);

}  // namespace mf
