// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <variant>

namespace mf {

// Why there is no OpenGL here, for people.
struct GlUnavailable {
  std::string reason;
};

// OpenGL 4.3 (core) with layered rendering from the vertex shader, without a window or a display server: on a graphics
// card through EGL's device platform, else on whatever Mesa's surfaceless platform has (its software rasterizer at
// least). The context is current on the thread that opened it and is used on that thread only.
class EglContext {
 public:
  // A graphics card is preferred to a software rasterizer.
  [[nodiscard]] static std::variant<EglContext, GlUnavailable> open();

  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;
  EglContext(EglContext&&) noexcept;
  EglContext& operator=(EglContext&&) = delete;
  ~EglContext();

  // The driver's name for what draws, e.g. "llvmpipe (LLVM 15.0.6, 256 bits)".
  [[nodiscard]] const std::string& renderer() const { return renderer_; }
  // It draws on the CPU.
  [[nodiscard]] bool is_software() const;

 private:
  EglContext(void* display, void* context);
  [[nodiscard]] static std::variant<EglContext, GlUnavailable> open_on(void* display);

  void* display_;  // EGLDisplay; shared by the process, never terminated
  void* context_;  // EGLContext; null after a move
  std::string renderer_;
};

}  // namespace mf
