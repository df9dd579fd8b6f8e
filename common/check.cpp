// SPDX-License-Identifier: Apache-2.0
#include "common/check.h"

#include <fmt/format.h>

#include <stdexcept>

namespace mf {

void check(bool condition, std::string_view what, std::source_location where) {
  if (condition) return;
  throw std::logic_error(fmt::format("{}:{}: internal error: {}", where.file_name(), where.line(), what));
}

}  // namespace mf
