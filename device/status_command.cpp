// SPDX-License-Identifier: Apache-2.0
#include "device/status_command.h"

#include <nlohmann/json.hpp>

namespace mf {

StatusCommand read_status_command(std::string_view line) {
  const nlohmann::json said = nlohmann::json::parse(line, nullptr, false);
  if (said.is_discarded() || !said.is_object()) return {std::nullopt, "that is no JSON object"};
  const auto command = said.find("command");
  if (command == said.end() || *command != "start") return {std::nullopt, "the only command is start"};
  const auto token = said.find("token");
  if (token == said.end() || !token->is_string()) return {std::nullopt, "start needs a token, a text"};
  return {token->get<std::string>(), {}};
}

}  // namespace mf
