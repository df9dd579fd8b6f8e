// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace mf {

// What the daemon tells systemd (sd_notify). Each does nothing when systemd did not start it (no NOTIFY_SOCKET), and
// none can fail: a service manager that does not listen is no reason to stop recording.

void notice_ready();                          // what the unit's dependants waited for is there
void notice_status(const std::string& line);  // for `systemctl status`
void notice_alive();                          // the watchdog's reminder
void notice_stopping();

// How often notice_alive() is due: half of what the unit's WatchdogSec allows. None: there is no watchdog.
[[nodiscard]] std::optional<std::chrono::microseconds> notice_alive_each();

}  // namespace mf
