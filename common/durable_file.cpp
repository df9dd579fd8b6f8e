// SPDX-License-Identifier: Apache-2.0
#include "common/durable_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "common/error.h"

namespace mf {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  throw WriteError(
      path.string(),
      fmt::format("cannot be written ({}): check the folder, its permissions and the free space", std::strerror(error)),
      error);
}

class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags) : value_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }

  [[nodiscard]] int value() const { return value_; }
  // 0, or -1 with errno: some file systems report a full disk only here.
  int close() {
    const int open = std::exchange(value_, -1);
    return open < 0 ? 0 : ::close(open);
  }

 private:
  int value_;
};

// 0 or errno.
int write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

// 0 or errno; "NAME.partial" is open only in here.
int write_aside(const std::filesystem::path& partial, std::string_view bytes, bool durable) {
  Descriptor descriptor(partial, O_WRONLY | O_CREAT | O_TRUNC);
  if (descriptor.value() < 0) return errno;
  if (const int error = write_all(descriptor.value(), bytes); error != 0) return error;
  if (durable && ::fsync(descriptor.value()) != 0) return errno;
  return descriptor.close() != 0 ? errno : 0;
}

}  // namespace

void write_whole_file(const std::filesystem::path& file, std::string_view bytes, bool durable) {
  std::filesystem::path partial = file;
  partial += ".partial";
  int error = write_aside(partial, bytes, durable);
  if (error == 0 && ::rename(partial.c_str(), file.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(partial.c_str());
    fail(file, error);
  }
  if (durable) sync_path(file.has_parent_path() ? file.parent_path() : ".");
}

void sync_path(const std::filesystem::path& file_or_folder, AfterSync after) {
  const Descriptor descriptor(file_or_folder, O_RDONLY);
  if (descriptor.value() < 0 || ::fsync(descriptor.value()) != 0) fail(file_or_folder, errno);
  if (after == AfterSync::drop) ::posix_fadvise(descriptor.value(), 0, 0, POSIX_FADV_DONTNEED);  // a wish, not a need
}

}  // namespace mf
