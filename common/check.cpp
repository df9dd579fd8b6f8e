// SPDX-License-Identifier: Apache-2.0
#include "common/check.h"

#include <fmt/format.h>

#include <stdexcept>

namespace mf {

void check(bool condition, std::string_view what, const char* file, int line) {
  if (condition) return;
  throw std::logic_error(fmt::format("{}:{}: internal error: {}", file, line, what));
}

}  // namespace mf
