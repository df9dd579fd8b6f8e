// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace mf {

// The hottest of the board's thermal zones, degrees Celsius; none where the kernel shows none.
[[nodiscard]] std::optional<double> board_temperature_c(const std::filesystem::path& sys = "/sys");

// What the folder's file system has left for the daemon's user; none when the folder is not there.
[[nodiscard]] std::optional<std::int64_t> free_bytes(const std::filesystem::path& folder);

}  // namespace mf
