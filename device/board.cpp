// SPDX-License-Identifier: Apache-2.0
#include "device/board.h"

#include <fstream>

namespace mf {

std::optional<double> board_temperature_c(const std::filesystem::path& sys) {
  std::optional<double> hottest;
  std::error_code ignored;  // no such folder: no zones
  for (const auto& zone : std::filesystem::directory_iterator(sys / "class/thermal", ignored)) {
    if (!zone.path().filename().string().starts_with("thermal_zone")) continue;
    std::ifstream in(zone.path() / "temp");
    double millidegrees = 0;
    if (!(in >> millidegrees) || millidegrees <= 0 || millidegrees > 150'000) continue;  // a zone without a sensor
    if (!hottest || millidegrees / 1000 > *hottest) hottest = millidegrees / 1000;
  }
  return hottest;
}

std::optional<std::int64_t> free_bytes(const std::filesystem::path& folder) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  if (error) return std::nullopt;
  return static_cast<std::int64_t>(space.available);
}

}  // namespace mf
