// SPDX-License-Identifier: Apache-2.0
#include "device/camera_keeper.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "common/error.h"

namespace mf {

namespace {

bool same_frames(const CameraDescription& a, const CameraDescription& b) {
  return a.format == b.format && a.width == b.width && a.height == b.height;
}

}  // namespace

CameraKeeper::CameraKeeper(OpenCamera open, std::chrono::milliseconds reopen_each)
    : open_(std::move(open)), reopen_each_(reopen_each), camera_(open_()), description_(camera_->description()) {
  camera_->start();
}

Received CameraKeeper::receive(CameraFrame& into, std::chrono::milliseconds at_most) {
  if (camera_ == nullptr) {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_try_)
      std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(at_most, next_try_ - now));
    else
      reopen();
    return Received::nothing;
  }
  const Received received = camera_->receive(into, at_most);
  if (received == Received::lost) {
    camera_.reset();
    next_try_ = std::chrono::steady_clock::now();
  }
  return received;
}

void CameraKeeper::set_exposure_s(double exposure_s) {
  exposure_s_ = exposure_s;
  if (camera_ == nullptr) return;
  camera_->set_exposure_s(exposure_s);
  description_ = camera_->description();
}

void CameraKeeper::reopen() {
  next_try_ = std::chrono::steady_clock::now() + reopen_each_;
  try {
    std::unique_ptr<CameraSource> camera = open_();
    if (!same_frames(camera->description(), description_)) return;
    if (exposure_s_) camera->set_exposure_s(*exposure_s_);
    camera->start();
    camera_ = std::move(camera);
  } catch (const InputError&) {  // not back yet
  }
}

}  // namespace mf
