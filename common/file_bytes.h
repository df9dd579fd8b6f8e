// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace mf {

// The whole file. Throws InputError naming it when it is missing, is a folder or cannot be read.
[[nodiscard]] std::string read_file_bytes(const std::filesystem::path&);

// The CRC-32 of zlib, PNG and Ethernet (reflected polynomial 0xEDB88320): what `crc32` and Python's zlib.crc32 print.
[[nodiscard]] std::uint32_t crc32(std::string_view bytes);

}  // namespace mf
