// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace mf {

// The most memory that this process has had resident so far (VmHWM of /proc/self/status), bytes; 0 where the system
// does not tell.
[[nodiscard]] std::int64_t peak_memory_bytes();

}  // namespace mf
