// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace mf {

// What a client of the status socket asks, or why it asks nothing.
struct StatusCommand {
  std::optional<std::string> start_token;
  std::string fault;
};

// One line, without its line feed. Any bytes.
[[nodiscard]] StatusCommand read_status_command(std::string_view line);

}  // namespace mf
