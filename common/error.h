// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace mf {

// Input that a user can mend. what() is one line: "FILE: FIELD: what is wrong, and what to do".
class InputError : public std::runtime_error {
 public:
  // `field` may be empty when the whole file is at fault.
  InputError(const std::string& file, const std::string& field, const std::string& problem_and_remedy);
};

// A file that the system would not write: `system_error` is errno (ENOSPC, EIO ...), which who records must tell apart.
class WriteError : public InputError {
 public:
  WriteError(const std::string& file, const std::string& problem_and_remedy, int system_error)
      : InputError(file, "", problem_and_remedy), system_error_(system_error) {}

  [[nodiscard]] int system_error() const { return system_error_; }
  [[nodiscard]] bool disk_is_full() const;

 private:
  int system_error_;
};

}  // namespace mf
