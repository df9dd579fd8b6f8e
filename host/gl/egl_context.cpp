// SPDX-License-Identifier: Apache-2.0
#include "host/gl/egl_context.h"

// epoxy declares EGL and GL by itself and loads each function at its first call.
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <utility>
#include <vector>

namespace mf {

namespace {

bool has_client_extension(const char* name) {
  return epoxy_has_egl_extension(EGL_NO_DISPLAY, name);
}

// Cards first, the surfaceless platform last.
std::vector<EGLDisplay> displays() {
  std::vector<EGLDisplay> found;
  if (has_client_extension("EGL_EXT_platform_device") && has_client_extension("EGL_EXT_device_enumeration")) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count) == EGL_TRUE)
      for (EGLint i = 0; i < count; ++i)
        found.push_back(
            eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr));
  }
  if (has_client_extension("EGL_MESA_platform_surfaceless"))
    found.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  std::erase(found, EGL_NO_DISPLAY);
  return found;
}

}  // namespace

EglContext::EglContext(void* display, void* context)
    : display_(display), context_(context), renderer_(reinterpret_cast<const char*>(glGetString(GL_RENDERER))) {}

EglContext::EglContext(EglContext&& other) noexcept
    : display_(other.display_),
      context_(std::exchange(other.context_, nullptr)),
      renderer_(std::move(other.renderer_)) {}

EglContext::~EglContext() {
  if (context_ == nullptr) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
}

bool EglContext::is_software() const {
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "SWR", "SwiftShader"})
    if (renderer_.find(name) != std::string::npos) return true;
  return false;
}

std::variant<EglContext, GlUnavailable> EglContext::open_on(void* display) {
  if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return GlUnavailable{"its EGL display does not start"};
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return GlUnavailable{"EGL knows no desktop OpenGL"};
  if (!epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context") ||
      !(epoxy_has_egl_extension(display, "EGL_KHR_no_config_context") ||
        epoxy_has_egl_extension(display, "EGL_MESA_configless_context")))
    return GlUnavailable{"EGL draws only into windows"};
  constexpr std::array<EGLint, 7> wanted{
      EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted.data());
  if (context == EGL_NO_CONTEXT) return GlUnavailable{"the driver has no OpenGL 4.3"};
  if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) != EGL_TRUE) {
    eglDestroyContext(display, context);
    return GlUnavailable{"the driver's context cannot be used without a window"};
  }
  EglContext opened(display, context);
  if (!epoxy_has_gl_extension("GL_ARB_shader_viewport_layer_array") &&
      !epoxy_has_gl_extension("GL_AMD_vertex_shader_layer"))
    return GlUnavailable{opened.renderer() + " cannot choose a layer in its vertex shader"};
  return opened;
}

std::variant<EglContext, GlUnavailable> EglContext::open() {
  GlUnavailable why{"no EGL driver is installed (Debian: libegl1 and libgl1-mesa-dri)"};
  void* software = nullptr;
  for (EGLDisplay display : displays()) {
    auto opened = open_on(display);
    if (auto* context = std::get_if<EglContext>(&opened)) {
      if (!context->is_software()) return opened;
      software = display;
    } else if (software == nullptr) {
      why = std::get<GlUnavailable>(opened);
    }
  }
  if (software != nullptr) return open_on(software);
  return why;
}

}  // namespace mf
