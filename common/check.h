// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <source_location>
#include <string_view>

namespace mf {

// A condition that only a bug of ours can break. Throws std::logic_error naming the place.
void check(bool condition, std::string_view what, std::source_location where = std::source_location::current());

}  // namespace mf
