// SPDX-License-Identifier: Apache-2.0
// libmirrorfield-sim-disk.so: preloaded into the daemon, it lets the disk be slow, full or broken (disk_faults.h).
// Sockets, pipes and terminals are left alone.
#include "hw-sim/disk_faults.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

namespace {

mf::sim::DiskFaults* mapped_faults() {
  const char* file = std::getenv("MIRRORFIELD_SIM_DISK");
  const int descriptor = file == nullptr ? -1 : ::open(file, O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return nullptr;
  void* memory = ::mmap(nullptr, sizeof(mf::sim::DiskFaults), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  ::close(descriptor);
  return memory == MAP_FAILED ? nullptr : static_cast<mf::sim::DiskFaults*>(memory);
}

// The error that this call has to have, or 0; waits first when the disk is slow.
int fault_of_call(int descriptor, std::atomic<std::int32_t> mf::sim::DiskFaults::*error) {
  static mf::sim::DiskFaults* const faults = mapped_faults();
  if (faults == nullptr) return 0;
  const int wanted = faults->*error, delay = faults->delay_us;
  struct stat what {};
  if ((wanted == 0 && delay == 0) || ::fstat(descriptor, &what) != 0 ||
      (!S_ISREG(what.st_mode) && !S_ISDIR(what.st_mode)))
    return 0;
  if (delay > 0) ::usleep(static_cast<useconds_t>(delay));
  if (wanted == 0) return 0;
  std::int32_t left = faults->failures;
  while (left > 0 && !faults->failures.compare_exchange_weak(left, left - 1)) {
  }
  return left != 0 ? wanted : 0;
}

template <typename Call>
Call* next_of(const char* name) {
  return reinterpret_cast<Call*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

ssize_t write(int descriptor, const void* bytes, size_t size) {
  static auto* const real = next_of<ssize_t(int, const void*, size_t)>("write");
  const int error = fault_of_call(descriptor, &mf::sim::DiskFaults::write_error);
  if (error == 0) return real(descriptor, bytes, size);
  errno = error;
  return -1;
}

ssize_t pwrite(int descriptor, const void* bytes, size_t size, off_t at) {
  static auto* const real = next_of<ssize_t(int, const void*, size_t, off_t)>("pwrite");
  const int error = fault_of_call(descriptor, &mf::sim::DiskFaults::write_error);
  if (error == 0) return real(descriptor, bytes, size, at);
  errno = error;
  return -1;
}

ssize_t pwrite64(int descriptor, const void* bytes, size_t size, off64_t at) {
  return pwrite(descriptor, bytes, size, at);
}

int fsync(int descriptor) {
  static auto* const real = next_of<int(int)>("fsync");
  const int error = fault_of_call(descriptor, &mf::sim::DiskFaults::sync_error);
  if (error == 0) return real(descriptor);
  errno = error;
  return -1;
}

int fdatasync(int descriptor) {
  static auto* const real = next_of<int(int)>("fdatasync");
  const int error = fault_of_call(descriptor, &mf::sim::DiskFaults::sync_error);
  if (error == 0) return real(descriptor);
  errno = error;
  return -1;
}

}  // extern "C"
