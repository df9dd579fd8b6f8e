// SPDX-License-Identifier: Apache-2.0
#include "common/file_bytes.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "common/error.h"

namespace mf {

namespace {

// Tables for four bytes at a time (Kounavis & Berry 2008, "slicing"): one byte at a time would cost as much as reading.
using CrcTables = std::array<std::array<std::uint32_t, 256>, 4>;

constexpr CrcTables make_crc_tables() {
  CrcTables tables{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) value = (value & 1U) != 0 ? (value >> 1U) ^ 0xEDB88320U : value >> 1U;
    tables[0][i] = value;
  }
  for (std::size_t slice = 1; slice < 4; ++slice)
    for (std::size_t i = 0; i < 256; ++i) {
      const std::uint32_t previous = tables[slice - 1][i];
      tables[slice][i] = (previous >> 8U) ^ tables[0][previous & 0xFFU];
    }
  return tables;
}

constexpr CrcTables crc_tables = make_crc_tables();

}  // namespace

std::uint32_t crc32(std::string_view bytes) {
  const auto byte_at = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i])); };
  std::uint32_t crc = 0xFFFFFFFFU;
  std::size_t i = 0;
  for (; i + 4 <= bytes.size(); i += 4) {
    crc ^= byte_at(i) | byte_at(i + 1) << 8U | byte_at(i + 2) << 16U | byte_at(i + 3) << 24U;
    crc = crc_tables[3][crc & 0xFFU] ^ crc_tables[2][crc >> 8U & 0xFFU] ^ crc_tables[1][crc >> 16U & 0xFFU] ^
          crc_tables[0][crc >> 24U];
  }
  for (; i < bytes.size(); ++i) crc = crc >> 8U ^ crc_tables[0][(crc ^ byte_at(i)) & 0xFFU];
  return ~crc;
}

std::string read_file_bytes(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) throw InputError(file.string(), "", "is a folder: a file is needed");
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  std::string bytes;
  if (in) {
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    bytes.resize(error ? 0 : static_cast<std::size_t>(size));
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  if (!in || error)
    throw InputError(file.string(), "",
                     fmt::format("cannot be read ({}): check that it exists and is readable",
                                 std::strerror(errno != 0 ? errno : EIO)));
  return bytes;
}

}  // namespace mf
