// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "device/owned_fd.h"

namespace mf {

// One daemon per recordings folder: a lock on the file ".mirrorfieldd.lock" there, which holds the process' id. The
// kernel lifts it when the process ends, however that happens; the file stays.
class InstanceLock {
 public:
  // Throws InputError: another daemon has it, or the folder cannot be written.
  explicit InstanceLock(const std::filesystem::path& recordings);

 private:
  OwnedFd file_;
};

// The process that holds the lock; 0 when it did not say. None: nobody does. Changes nothing.
[[nodiscard]] std::optional<long> instance_lock_holder(const std::filesystem::path& recordings);

}  // namespace mf
