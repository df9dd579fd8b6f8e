// SPDX-License-Identifier: Apache-2.0
#include "host/gl/shader_source.h"

#include <sstream>

#include "common/check.h"

namespace mf {

std::string shader_source(std::string_view name) {
  const std::string_view text = embedded_shader(name);
  check(!text.empty(), "a shader named " + std::string(name));
  constexpr std::string_view include = "#include \"";
  std::istringstream lines{std::string(text)};
  std::string source;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(include))
      source += shader_source(std::string_view(line).substr(include.size(), line.rfind('"') - include.size()));
    else
      source += line + "\n";
  }
  return source;
}

}  // namespace mf
