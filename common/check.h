// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace mf {

// A condition that only a bug of ours can break. Throws std::logic_error naming the place. (The builtins are what
// std::source_location is made of; clang-tidy 14 cannot read that header.)
void check(bool condition, std::string_view what, const char* file = __builtin_FILE(), int line = __builtin_LINE());

}  // namespace mf
