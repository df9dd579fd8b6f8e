// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace mf {

// Where and why a text is no JSON.
struct JsonFault {
  std::string field;    // the value at fault, as "[17].exposure_s"; empty for the whole document
  std::string problem;  // line, column, what is there and what to do
};

// Nothing when the text is JSON.
[[nodiscard]] std::optional<JsonFault> find_json_fault(std::string_view text);

}  // namespace mf
