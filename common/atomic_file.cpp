// SPDX-License-Identifier: Apache-2.0
#include "common/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

#include "common/error.h"

namespace mf {

namespace {

[[noreturn]] void fail_to_write(const std::filesystem::path& destination, int error) {
  throw InputError(destination.string(), "",
                   fmt::format("cannot be written ({}): check the folder, its permissions and the free space",
                               std::strerror(error)));
}

void sync_file(const std::filesystem::path& file, const std::filesystem::path& destination) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) fail_to_write(destination, errno);
  const int failed = ::fsync(descriptor);
  const int error = errno;
  ::close(descriptor);
  if (failed != 0) fail_to_write(destination, error);
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path destination)
    : destination_(std::move(destination)), partial_(destination_) {
  partial_ += ".partial";
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  std::error_code ignored;  // nothing more can be done about a leftover in a destructor
  std::filesystem::remove(partial_, ignored);
}

void AtomicFile::commit() {
  sync_file(partial_, destination_);
  std::error_code error;
  std::filesystem::rename(partial_, destination_, error);
  if (error) fail_to_write(destination_, error.value());
  committed_ = true;
}

void write_file_atomically(const std::filesystem::path& destination, std::string_view content) {
  AtomicFile file(destination);
  {
    errno = 0;
    std::ofstream out(file.path(), std::ios::binary | std::ios::trunc);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.close();
    if (!out) fail_to_write(destination, errno != 0 ? errno : EIO);
  }
  file.commit();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw InputError(folder.string(), "", "cannot be made (" + error.message() + "): give another folder");
}

}  // namespace mf
