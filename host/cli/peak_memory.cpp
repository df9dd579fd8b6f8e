// SPDX-License-Identifier: Apache-2.0
#include "host/cli/peak_memory.h"

#include <fstream>
#include <string>

namespace mf {

std::int64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line))
    if (line.starts_with("VmHWM:")) {
      constexpr std::int64_t bytes_in_kb = 1024;
      return std::stoll(line.substr(line.find(':') + 1)) * bytes_in_kb;
    }
  return 0;
}

}  // namespace mf
