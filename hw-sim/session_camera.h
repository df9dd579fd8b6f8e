// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hw-sim/gige_camera.h"

namespace mf::sim {

struct PlayOptions {
  GigeCameraOptions camera;  // format and size come from the session
  int times = 1;             // how often the recording is played, ≥ 0; 0: for ever
};

// Plays a session's mirror frames as a GigE Vision camera, in the session's pixel format, starting when a client does.
// All frames are read before the camera answers. Frame numbers go on from one playing to the next.
class SessionCamera {
 public:
  // Throws InputError: no session, frames that no camera sends (RGB, float), no mirror frames, the address taken.
  SessionCamera(const std::filesystem::path& session, const PlayOptions&);

  [[nodiscard]] const GigeCameraOptions& options() const { return options_; }
  [[nodiscard]] bool finished() const;  // everything was sent
  [[nodiscard]] GigeCameraCounts counts() const { return camera_->counts(); }

 private:
  GigeCameraOptions options_;
  std::vector<std::vector<std::uint8_t>> payloads_;
  std::unique_ptr<GigeCamera> camera_;  // after what it sends
};

}  // namespace mf::sim
