// SPDX-License-Identifier: Apache-2.0
#include "host/gl/backend.h"

#include <utility>

#include "common/error.h"

namespace mf {

std::optional<Backend> parse_backend(std::string_view name) {
  if (name == "auto") return Backend::automatic;
  if (name == "gl") return Backend::gl;
  if (name == "cpu") return Backend::cpu;
  return std::nullopt;
}

std::optional<EglContext> open_backend(Backend backend) {
  if (backend == Backend::cpu) return std::nullopt;
  auto opened = EglContext::open();
  if (const auto* missing = std::get_if<GlUnavailable>(&opened)) {
    if (backend == Backend::automatic) return std::nullopt;
    throw InputError("OpenGL", "--backend gl",
                     "is not to be had here: " + missing->reason + "; use --backend cpu, the pictures are the same");
  }
  auto& context = std::get<EglContext>(opened);
  // Our own code is faster than a rasterizer that runs on the same processor.
  if (backend == Backend::automatic && context.is_software()) return std::nullopt;
  return std::move(context);
}

std::string describe(const std::optional<EglContext>& context) {
  return context ? "gl (" + context->renderer() + ")" : "cpu";
}

}  // namespace mf
