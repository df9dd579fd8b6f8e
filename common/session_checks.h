// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "common/session.h"

namespace mf {

// SQLite notices damage to a database's structure, not to the values in it: each frame's row has a checksum of its own
// (table `checks`), the CRC-32 of this text, its arrival included when there is one:
//
//   id|role|name|exposure_s|nd_density|time_s|file|bytes|crc32[|device_frame|device_ns|monotonic_ns|realtime_ns]
//
// with the real numbers as the 16 hexadecimal digits of their IEEE 754 bits.
[[nodiscard]] std::uint32_t row_check(const SessionFrame&);

// Throws nothing: a folder that cannot be read holds none.
[[nodiscard]] std::int64_t count_frame_files(const std::filesystem::path& session_folder);

}  // namespace mf
