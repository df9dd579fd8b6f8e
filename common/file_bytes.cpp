// SPDX-License-Identifier: Apache-2.0
#include "common/file_bytes.h"

#include <fmt/format.h>
#include <isa-l/crc.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "common/error.h"

namespace mf {

std::uint32_t crc32(std::string_view bytes) {
  return crc32_gzip_refl(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
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
