// SPDX-License-Identifier: Apache-2.0
#include "device/instance_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "common/error.h"

namespace mf {

namespace {

constexpr const char* lock_name = ".mirrorfieldd.lock";

long holder_of(int file) {
  std::array<char, 32> text{};
  return ::pread(file, text.data(), text.size() - 1, 0) > 0 ? std::strtol(text.data(), nullptr, 10) : 0;
}

}  // namespace

InstanceLock::InstanceLock(const std::filesystem::path& recordings) {
  const std::filesystem::path name = recordings / lock_name;
  file_ = OwnedFd(::open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644));
  if (file_.get() < 0)
    throw InputError(
        recordings.string(), "",
        fmt::format("the recordings folder cannot be written: {}: make it, or give it to the daemon's user",
                    std::strerror(errno)));
  if (::flock(file_.get(), LOCK_EX | LOCK_NB) != 0)
    throw InputError(recordings.string(), "",
                     fmt::format("another mirrorfieldd (process {}) records there already: stop that one first, or "
                                 "name another recording.folder",
                                 holder_of(file_.get())));
  const std::string id = fmt::format("{}\n", ::getpid());
  // Only for people who ask who it is: the lock holds whether or not this can be written.
  if (::ftruncate(file_.get(), 0) == 0) (void)!::pwrite(file_.get(), id.data(), id.size(), 0);
}

std::optional<long> instance_lock_holder(const std::filesystem::path& recordings) {
  const OwnedFd file(::open((recordings / lock_name).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  if (file.get() < 0 || ::flock(file.get(), LOCK_SH | LOCK_NB) == 0 || errno != EWOULDBLOCK) return std::nullopt;
  return holder_of(file.get());
}

}  // namespace mf
