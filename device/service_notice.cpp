// SPDX-License-Identifier: Apache-2.0
#include "device/service_notice.h"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cstdint>

namespace mf {

void notice_ready() {
  (void)sd_notify(0, "READY=1");
}

void notice_status(const std::string& line) {
  std::string message = "STATUS=" + line;
  std::replace(message.begin(), message.end(), '\n', ' ');  // which would begin another assignment
  (void)sd_notify(0, message.c_str());
}

void notice_alive() {
  (void)sd_notify(0, "WATCHDOG=1");
}

void notice_stopping() {
  (void)sd_notify(0, "STOPPING=1");
}

std::optional<std::chrono::microseconds> notice_alive_each() {
  std::uint64_t allowed_us = 0;
  if (sd_watchdog_enabled(0, &allowed_us) <= 0) return std::nullopt;
  return std::chrono::microseconds(allowed_us / 2);
}

}  // namespace mf
