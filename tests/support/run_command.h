// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace mf::test {

struct CommandOutcome {
  int exit_code = -1;  // -1: did not run, or was killed by a signal
  std::string out;
  std::string err;

  [[nodiscard]] int error_lines() const;
};

// Runs a program (looked up in PATH) without a shell and waits for it.
[[nodiscard]] CommandOutcome run_command(const std::vector<std::string>& arguments);

// True when `program` is in PATH.
[[nodiscard]] bool has_program(const std::string& program);

}  // namespace mf::test
