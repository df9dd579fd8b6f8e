// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <optional>

#include "device/camera_source.h"
#include "device/metering.h"

namespace mf {

// Opens the camera; called again whenever it was lost. Throws InputError.
using OpenCamera = std::function<std::unique_ptr<CameraSource>()>;

// One camera, for as long as the daemon runs: opened again, set as it was metered, whenever it is lost. To close a
// camera that is gone, and to look for it, can take seconds: a thread of its own waits for that, while there is one.
class CameraKeeper {
 public:
  // Opens and starts it. Throws InputError when it is not there or does not start.
  CameraKeeper(OpenCamera, std::chrono::milliseconds reopen_each);

  // Waits for that thread.
  ~CameraKeeper() = default;
  CameraKeeper(const CameraKeeper&) = delete;
  CameraKeeper& operator=(const CameraKeeper&) = delete;

  // Of the first opening. A camera that comes back with other frames is not taken.
  [[nodiscard]] const CameraDescription& description() const { return description_; }
  // nullptr while it is away.
  [[nodiscard]] CameraSource* camera() { return camera_.get(); }

  // As CameraSource::receive(); while the camera is away it tells `nothing`. `lost` is told once.
  [[nodiscard]] Received receive(CameraFrame& into, std::chrono::milliseconds at_most);
  // Lets the metering set it, and keeps what it found: a camera that comes back is set so again. Nothing happens while
  // the camera is away. Throws InputError.
  std::optional<MeteringResult> meter(const MeteringOptions&, const FindTags&);

 private:
  [[nodiscard]] std::unique_ptr<CameraSource> reopened() const;
  void look_for_camera(std::chrono::milliseconds at_most);

  OpenCamera open_;  // while the camera is away: that thread's
  std::chrono::milliseconds reopen_each_;
  std::unique_ptr<CameraSource> camera_;
  CameraDescription description_;
  std::optional<MeteringResult> metered_;
  std::chrono::steady_clock::time_point next_try_;
  std::future<std::unique_ptr<CameraSource>>
      opening_;  // nullptr: not back yet. The last member: its thread uses others
};

}  // namespace mf
