// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "device/camera_keeper.h"
#include "device/lookout.h"
#include "device/recording.h"
#include "device/rig_status.h"

namespace mf {

struct RigOptions {
  std::filesystem::path recordings;              // sessions are made below it, named by the time (UTC)
  std::optional<std::filesystem::path> session;  // the next one's place instead
  SessionHeader header;                          // what the camera does not know
  RecorderOptions recorder;
  std::chrono::milliseconds reopen_each{200};  // after the camera is lost
  std::chrono::milliseconds tell_each{200};    // how often the status is told while nothing happens
  double most_seconds = 0;                     // of a recording; 0: until stopped
  std::int64_t least_free_bytes = 64 << 20;    // with less, a recording is not begun
  std::optional<MeteringOptions> metering;     // nothing: the camera stays as it was opened
  std::optional<LookoutOptions> lookout;       // nothing: frames are recorded unseen
};

enum class RigCommand { start, stop };

// Whom the rig hears and tells, between two frames: none may block. Each may be left empty.
struct RigLinks {
  std::function<std::optional<RigCommand>()> next_command;
  std::function<void(const RigStatus&)> tell;
};

// The daemon's loop: a camera that always runs, and recordings that the operator starts and stops.
//
//   metering ──▶ idle ──start──▶ recording ──stop──▶ done ──start──▶ recording ...
//                                    └── the disk or the camera's settings fail ──▶ error ──start──▶ recording ...
//
// The recording's first frame is its scene picture when the mirror was out of view at the start.
//
// It meters when the camera is there, and again between recordings when the light has changed; from the start of a
// recording to its end everything stays as it is. A recording of a camera whose response is known brings its
// response.json along.
//
// `recording` is told from the first durable frame on. A disk that refuses the session's index, or frame after frame,
// ends that session; unless the disk is full, the recording goes on in another one ("NAME-2"), with an alarm.
class Rig {
 public:
  // Opens the camera. Throws InputError.
  Rig(OpenCamera, const RigOptions&, RigLinks);

  // One frame's time: 0.1 s at most, more only while a lost camera is looked for.
  void step();
  void obey(RigCommand);

  [[nodiscard]] bool is_recording() const { return recording_.has_value(); }
  [[nodiscard]] const RigStatus& status() const { return status_; }
  [[nodiscard]] const CameraDescription& camera() const { return keeper_.description(); }

 private:
  void start();
  void stop();
  void begin(const std::filesystem::path& session);
  void forget_waiting_frames();
  void end(RigState, const std::string& problem);
  void watch_recording();
  void go_on_elsewhere(const RecorderStatus&);
  void note(const RecorderStatus&);
  void tell_regularly();
  void tell_now();
  void meter();
  void watch_light();
  void look_out();
  void note_sights();
  [[nodiscard]] bool has_time_to_look() const;

  CameraKeeper keeper_;
  RigOptions options_;
  RigLinks links_;
  RigStatus status_;
  std::unique_ptr<Lookout> lookout_;  // made anew when the camera's response changes
  CameraFrame spare_;                 // received into while nothing is recorded
  std::optional<Recording> recording_;
  std::chrono::steady_clock::time_point began_;  // the recording, over all its sessions
  std::chrono::steady_clock::time_point told_;
  int continuations_ = 0;
  RecorderStatus before_;     // sums over the sessions that this one continues
  bool scene_comes_ = false;  // the next frame is the scene picture
  std::string alarm_;         // stays until the next start
  std::int64_t frames_ = 0;   // since the rate was taken last
  std::chrono::steady_clock::time_point rated_;
  std::chrono::steady_clock::time_point looked_;  // at the light
};

}  // namespace mf
