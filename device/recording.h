// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "device/camera_source.h"
#include "device/clock_fit.h"
#include "device/recorder.h"

namespace mf {

// One session while it is recorded: a recorder, and the count of what the camera's own numbers say is missing. Writes
// the camera's description beside the frames (document "device"), and at the end the camera's clock in the host's time
// (document "clock": ClockFit's line).
class Recording {
 public:
  // Format and size of `header` are set from the camera. Throws InputError when the session cannot be made.
  Recording(const std::filesystem::path& session, SessionHeader header, const CameraDescription&,
            const RecorderOptions&);

  // Where to receive the next frame into: a buffer of the recorder's, or a spare when it has none to give, as the
  // camera must not be kept waiting. Owned here.
  [[nodiscard]] CameraFrame& next_buffer();
  // What came of receiving into it.
  void take(Received, FrameRole = FrameRole::mirror);
  void note_tags(const FrameArrival& arrival, std::vector<TagDetection> tags,
                 const std::optional<Rigid3>& cam_from_mirror) {
    recorder_->note_tags(arrival, std::move(tags), cam_from_mirror);
  }

  [[nodiscard]] const std::filesystem::path& session() const { return session_; }
  [[nodiscard]] RecorderStatus status() const { return recorder_->status(); }
  // Everything durable, the session closed.
  RecorderStatus finish();

 private:
  void count(const FrameArrival&);

  std::filesystem::path session_;
  std::optional<Recorder> recorder_;
  CameraFrame spare_;
  CameraFrame* buffer_ = nullptr;  // the recorder's, between next_buffer() and take()
  ClockFit clock_;
  FrameArrival last_;  // device_frame 0: none since the camera was opened
};

// Frames between two of the camera's numbers. GigE Vision's 16-bit numbers go from 65535 to 1; 0 is no number.
[[nodiscard]] std::int64_t frames_between(std::int64_t before, std::int64_t after);

}  // namespace mf
