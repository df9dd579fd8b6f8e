// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace mf::test {

// A program that runs beside the test, in a process group of its own. The end of this object is the end of the group.
class ChildProcess {
 public:
  // `kept`: descriptors that become 3, 4, … in the program. Its output is dropped, except what first_line() takes.
  explicit ChildProcess(const std::vector<std::string>& arguments, const std::vector<int>& kept = {});
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  [[nodiscard]] pid_t pid() const { return pid_; }
  // Of its standard output; empty when it ended without one.
  [[nodiscard]] std::string first_line();
  // SIGTERM, and its exit code (-1: by a signal).
  int end();

  // Until it ends by itself, and its exit code (-1: by a signal).
  int wait();

  [[nodiscard]] double cpu_seconds() const;
  [[nodiscard]] long resident_kb() const;

 private:
  pid_t pid_ = -1;
  int out_ = -1;
};

}  // namespace mf::test
