// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "host/gl/egl_context.h"

namespace mf {

// Who computes a picture. automatic: gl on a graphics card; cpu where OpenGL is missing or itself runs on the CPU.
enum class Backend { automatic, gl, cpu };
[[nodiscard]] std::optional<Backend> parse_backend(std::string_view name);  // "auto", "gl", "cpu"

// What the choice comes to here; nothing: the CPU. Throws InputError when gl is asked for and OpenGL 4.3 is not to be
// had.
[[nodiscard]] std::optional<EglContext> open_backend(Backend);

// "cpu", or "gl" with the renderer's name.
[[nodiscard]] std::string describe(const std::optional<EglContext>&);

}  // namespace mf
