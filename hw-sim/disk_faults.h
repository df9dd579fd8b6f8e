// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace mf::sim {

// Shared by the scenario, which sets it, and libmirrorfield-sim-disk.so in the daemon, which obeys: the file that the
// environment's MIRRORFIELD_SIM_DISK names, mapped by both. All zero: the disk is well.
struct DiskFaults {
  std::atomic<std::int32_t> write_error;  // errno of write() and pwrite() to files; 0: none
  std::atomic<std::int32_t> sync_error;   // errno of fsync() and fdatasync()
  std::atomic<std::int32_t> failures;     // so many calls fail, then none; negative: all
  std::atomic<std::int32_t> delay_us;     // added to each of these calls
};
static_assert(std::atomic<std::int32_t>::is_always_lock_free, "two processes share it");

}  // namespace mf::sim
