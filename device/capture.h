// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>

#include "device/camera_keeper.h"
#include "device/recording.h"

namespace mf {

struct CaptureOptions {
  RecorderOptions recorder;
  double most_seconds = 0;                     // 0: until stopped
  std::chrono::milliseconds reopen_each{200};  // after the camera is lost
};

struct CaptureResult {
  CameraDescription camera;
  RecorderStatus recorder;
  double seconds = 0;
};

// Records one session until `stop` or most_seconds: opens the camera, writes its description beside the frames
// (document "device"), and counts what the camera's own frame numbers say is missing. A lost camera is opened again
// into the same session, with a gap. `header` gives what the camera does not know: format and size are set from the
// camera. Throws InputError when the camera cannot be opened at first or the session not be made; what fails later is
// in the result, and what was durable then stays.
[[nodiscard]] CaptureResult capture(const OpenCamera&, const std::filesystem::path& session, SessionHeader header,
                                    const CaptureOptions&, const std::atomic<bool>& stop,
                                    const std::function<void(const RecorderStatus&)>& each_second = {});

}  // namespace mf
