// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "device/camera_source.h"

namespace mf {

// Opens the camera; called again whenever it was lost. Throws InputError.
using OpenCamera = std::function<std::unique_ptr<CameraSource>()>;

// One camera, for as long as the daemon runs: opened again, with the exposure it had, whenever it is lost.
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
  // Read back into description(). While the camera is away, it gets it when it is back. Throws InputError.
  void set_exposure_s(double);

 private:
  void reopen();

  OpenCamera open_;
  std::chrono::milliseconds reopen_each_;
  std::unique_ptr<CameraSource> camera_;
  CameraDescription description_;
  std::optional<double> exposure_s_;  // that was set
  std::chrono::steady_clock::time_point next_try_;
};

}  // namespace mf
