// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arv.h>

#include <chrono>
#include <future>

namespace mf {

// Whether a GigE camera still is under our control. One that lost its power for a moment has booted anew: it answers,
// but has forgotten its client, and sends nothing. Aravis' heartbeat looks once a second and is patient; this looks as
// soon as frames stay away.
class GigeControl {
 public:
  // `device` must outlive this. Frames that come later than `patience` after each other make it look.
  GigeControl(ArvDevice* device, std::chrono::milliseconds patience);

  void note_frame() { last_frame_ = std::chrono::steady_clock::now(); }
  // Never waits for the camera. One that neither sends nor answers is lost after three seconds.
  [[nodiscard]] bool is_lost();

 private:
  ArvDevice* device_;
  std::chrono::milliseconds patience_;
  std::chrono::steady_clock::time_point last_frame_;
  std::future<bool> asking_;  // true: lost
};

}  // namespace mf
