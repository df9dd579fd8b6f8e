// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "device/status/disk_forecast.h"
#include "device/status/rig_link.h"

namespace mf {

// What browsers are told (docs/status.md). Made once for all of them.
struct PageTexts {
  std::uint64_t number = 0;                          // one more each time
  std::uint64_t preview_number = 0;                  // one more for each new picture; 0: none yet
  std::string status;                                // /status.json: everything but the picture's pixels
  std::string status_event;                          // the same for /events
  std::shared_ptr<const std::string> preview_event;  // the picture with its tags; nothing before the first
};

class PageTextMaker {
 public:
  explicit PageTextMaker(bool remote_start) : remote_start_(remote_start) {}
  [[nodiscard]] std::shared_ptr<const PageTexts> make(const RigNews&, std::chrono::steady_clock::time_point now);

 private:
  bool remote_start_;
  DiskForecast forecast_;
  std::uint64_t number_ = 0;
  std::uint64_t preview_number_ = 0;
  std::shared_ptr<const std::string> preview_event_;
  std::shared_ptr<const RigStatus> previewed_;  // whose picture that is
  std::optional<double> seconds_left_;
};

}  // namespace mf
