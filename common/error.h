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

}  // namespace mf
