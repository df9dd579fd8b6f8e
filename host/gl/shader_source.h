// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace mf {

// The text of shaders/NAME, which is part of the binary, every line `#include "common_x.glsl"` replaced by that file.
// Precondition: there is such a shader.
[[nodiscard]] std::string shader_source(std::string_view name);

// The text as it lies in shaders/; empty when there is none of that name. Generated at build time.
[[nodiscard]] std::string_view embedded_shader(std::string_view name);

}  // namespace mf
