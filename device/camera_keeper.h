// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "device/camera_source.h"
#include "device/metering.h"

namespace mf {

// Opens the camera; called again whenever it was lost. Throws InputError.
using OpenCamera = std::function<std::unique_ptr<CameraSource>()>;

// One camera, for as long as the daemon runs: opened again, set as it was metered, whenever it is lost.
class CameraKeeper {
 public:
  // Opens and starts it. Throws InputError when it is not there or does not start.
  CameraKeeper(OpenCamera, std::chrono::milliseconds reopen_each);

  // Of the first opening. A camera that comes back with other frames is not taken.
  [[nodiscard]] const CameraDescription& description() const { return description_; }
  // nullptr while it is away.
  [[nodiscard]] CameraSource* camera() { return camera_.get(); }

  // As CameraSource::receive(); while the camera is away it tries to open it and tells `nothing`. `lost` is told once.
  [[nodiscard]] Received receive(CameraFrame& into, std::chrono::milliseconds at_most);
  // Lets the metering set it, and keeps what it found: a camera that comes back is set so again. Nothing happens while
  // the camera is away. Throws InputError.
  std::optional<MeteringResult> meter(const MeteringOptions&, const FindTags&);

 private:
  void reopen();

  OpenCamera open_;
  std::chrono::milliseconds reopen_each_;
  std::unique_ptr<CameraSource> camera_;
  CameraDescription description_;
  std::optional<MeteringResult> metered_;
  std::chrono::steady_clock::time_point next_try_;
};

}  // namespace mf
