// SPDX-License-Identifier: Apache-2.0
#include "device/status/disk_forecast.h"

namespace mf {

std::optional<double> DiskForecast::seconds_left(const RigStatus& status, Clock::time_point now) {
  constexpr std::chrono::seconds window{30}, apart{1}, shortest{5};
  if (status.state != RigState::recording) {
    readings_.clear();
    return std::nullopt;
  }
  if (readings_.empty() || now - readings_.back().at >= apart) readings_.push_back({now, status.free_bytes});
  while (now - readings_.front().at > window) readings_.pop_front();
  if (readings_.empty()) return std::nullopt;
  const double seconds = std::chrono::duration<double>(now - readings_.front().at).count();
  const auto fallen = static_cast<double>(readings_.front().free_bytes - status.free_bytes);
  if (now - readings_.front().at < shortest || fallen <= 0) return std::nullopt;
  return static_cast<double>(status.free_bytes) / (fallen / seconds);
}

}  // namespace mf
