// SPDX-License-Identifier: Apache-2.0
#include "common/error.h"

#include <cerrno>

namespace mf {

namespace {
std::string one_line(const std::string& file, const std::string& field, const std::string& problem) {
  std::string line = file;
  if (!field.empty()) line += ": " + field;
  line += ": " + problem;
  for (char& c : line)
    if (c == '\n' || c == '\r') c = ' ';
  return line;
}
}  // namespace

InputError::InputError(const std::string& file, const std::string& field, const std::string& problem_and_remedy)
    : std::runtime_error(one_line(file, field, problem_and_remedy)) {}

bool WriteError::disk_is_full() const {
  return system_error_ == ENOSPC || system_error_ == EDQUOT;
}

}  // namespace mf
