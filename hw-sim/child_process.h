// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mf::sim {

// A program that was started and is waited for; killed when this goes.
class ChildProcess {
 public:
  // `environment` is set beside ours. Throws InputError when there is no such program.
  ChildProcess(const std::vector<std::string>& command, const std::map<std::string, std::string>& environment);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  void signal(int number) const;
  [[nodiscard]] pid_t process() const { return process_; }
  // Its exit code, 128 + the signal that ended it; nothing when it still runs after `at_most`.
  [[nodiscard]] std::optional<int> wait(std::chrono::milliseconds at_most);

 private:
  pid_t process_ = -1;
  std::optional<int> exit_code_;
};

}  // namespace mf::sim
