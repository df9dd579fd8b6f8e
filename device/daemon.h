// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "device/config.h"
#include "device/rig_status.h"

namespace mf {

struct DaemonOptions {
  bool record_now = false;                       // begin at once, and end with that recording
  std::optional<std::filesystem::path> session;  // of the first recording; else one named by the time
  double most_seconds = 0;                       // of a recording; 0: until stopped
};

// The rig's service, until `stop`: camera, button, lamp, status socket, systemd. `show` hears each status. Returns the
// last one. Throws InputError: the camera is not there, another daemon has the folder, nothing could start a recording.
RigStatus run_daemon(const DeviceConfig&, const DaemonOptions&, const std::atomic<bool>& stop,
                     const std::function<void(const RigStatus&)>& show);

// The camera of the config, whichever transport it has. Throws InputError.
[[nodiscard]] std::unique_ptr<CameraSource> open_camera(const CameraSettings&);

}  // namespace mf
