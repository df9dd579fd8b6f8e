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

// What to ask of a camera for it to be set like this again; nothing where nobody knows.
std::optional<ResponseRequest> request_of(const ResponseSetting& setting) {
  if (const auto* slopes = std::get_if<MultiSlopeSensor>(&setting.in_force)) return *slopes;
  if (const auto* pixel = std::get_if<LinLogSensor>(&setting.in_force)) return *pixel;
  return std::nullopt;
}

}  // namespace

CameraKeeper::CameraKeeper(OpenCamera open, std::chrono::milliseconds reopen_each)
    : open_(std::move(open)), reopen_each_(reopen_each), camera_(open_()), description_(camera_->description()) {
  camera_->start();
}

Received CameraKeeper::receive(CameraFrame& into, std::chrono::milliseconds at_most) {
  if (camera_ == nullptr) {
    look_for_camera(at_most);
    return Received::nothing;
  }
  const Received received = camera_->receive(into, at_most);
  if (received == Received::lost) {
    next_try_ = std::chrono::steady_clock::now() + reopen_each_;
    opening_ = std::async(std::launch::async, [this, gone = std::move(camera_)]() mutable {
      gone.reset();
      return reopened();
    });
  }
  return received;
}

std::optional<MeteringResult> CameraKeeper::meter(const MeteringOptions& options, const FindTags& find_tags) {
  if (camera_ == nullptr) return std::nullopt;
  const MeteringResult result = mf::meter(*camera_, options, find_tags);
  if (result.camera_lost) return std::nullopt;  // the next receive() tells
  metered_ = result;
  description_.exposure_s = result.exposure_s;
  description_.response = result.response;
  return result;
}

void CameraKeeper::look_for_camera(std::chrono::milliseconds at_most) {
  if (!opening_.valid()) {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_try_)
      return std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(at_most, next_try_ - now));
    next_try_ = now + reopen_each_;
    opening_ = std::async(std::launch::async, [this] { return reopened(); });
  }
  if (opening_.wait_for(at_most) == std::future_status::ready) camera_ = opening_.get();
}

std::unique_ptr<CameraSource> CameraKeeper::reopened() const {
  try {
    std::unique_ptr<CameraSource> camera = open_();
    if (!same_frames(camera->description(), description_)) return nullptr;
    if (metered_) {
      camera->set_exposure_s(metered_->exposure_s);
      if (const auto request = request_of(metered_->response))
        (void)apply_response(camera->features(), request, metered_->exposure_s);
    }
    camera->start();
    return camera;
  } catch (const InputError&) {
    return nullptr;
  }
}

}  // namespace mf
