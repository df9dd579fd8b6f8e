// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/window.h"

#define GLFW_INCLUDE_NONE  // OpenGL comes from epoxy
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <utility>
#include <vector>

#include "common/error.h"
#include "host/io/image_file.h"
#include "host/viewer/layout.h"

namespace mf {

namespace {

std::string display_name() {
  for (const char* variable : {"WAYLAND_DISPLAY", "DISPLAY"})
    if (const char* name = std::getenv(variable); name != nullptr && *name != '\0') return name;
  return {};
}

// GLFW from its start to its end.
class Glfw {
 public:
  Glfw() {
    if (glfwInit() == GLFW_TRUE) return;
    const std::string display = display_name();
    throw InputError("view", "display",
                     display.empty() ? "there is none: run it on a desktop, through ssh -X, or under xvfb-run"
                                     : "'" + display + "' does not open: check DISPLAY and who may use it");
  }
  Glfw(const Glfw&) = delete;
  Glfw& operator=(const Glfw&) = delete;
  ~Glfw() { glfwTerminate(); }
};

struct DestroyWindow {
  void operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }
};
using WindowHandle = std::unique_ptr<GLFWwindow, DestroyWindow>;

WindowHandle open_window(const std::string& title, int width, int height) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  WindowHandle window(glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr));
  if (window == nullptr) {
    const char* why = nullptr;
    glfwGetError(&why);
    throw InputError("view", "display",
                     fmt::format("'{}' has no OpenGL 3.3 ({}): install a driver (Debian: libgl1-mesa-dri)",
                                 display_name(), why == nullptr ? "no reason given" : why));
  }
  glfwSetWindowSizeLimits(window.get(), smallest_window_width_px, smallest_window_height_px, GLFW_DONT_CARE,
                          GLFW_DONT_CARE);
  glfwMakeContextCurrent(window.get());
  glfwSwapInterval(1);
  return window;
}

// Dear ImGui from its start to its end.
class Gui {
 public:
  explicit Gui(GLFWwindow* window) {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;  // panels have fixed places: nothing to remember in the user's folder
    ImGui::StyleColorsDark();
    ImGui_ImplGlfw_InitForOpenGL(window, true);
    ImGui_ImplOpenGL3_Init("#version 330");
  }
  Gui(const Gui&) = delete;
  Gui& operator=(const Gui&) = delete;
  ~Gui() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
  }
};

// A key that went down, and whether Ctrl was down with it then.
struct KeyPress {
  int key = 0;  // GLFW's; letters are ASCII
  bool with_ctrl = false;
};

}  // namespace

// In the order in which they need each other.
struct Window::Handles {
  Glfw glfw;
  // Dear ImGui 1.86 only knows what is down when a frame begins. It calls the callbacks that it finds: this one stays.
  std::vector<KeyPress> arriving, pressed;  // since the last frame began, and before it
  WindowHandle window;
  Gui gui;

  Handles(const std::string& title, int width, int height)
      : window(listening(open_window(title, width, height), arriving)), gui(window.get()) {}

  static WindowHandle listening(WindowHandle window, std::vector<KeyPress>& presses) {
    glfwSetWindowUserPointer(window.get(), &presses);
    glfwSetKeyCallback(window.get(), [](GLFWwindow* w, int key, int, int action, int modifiers) {
      if (action == GLFW_PRESS)
        static_cast<std::vector<KeyPress>*>(glfwGetWindowUserPointer(w))
            ->push_back({key, (modifiers & GLFW_MOD_CONTROL) != 0});
    });
    return window;
  }
  [[nodiscard]] bool was_pressed(int key, bool with_ctrl) const {
    return std::any_of(pressed.begin(), pressed.end(),
                       [&](const KeyPress& p) { return p.key == key && p.with_ctrl == with_ctrl; });
  }
};

Window::Window(const std::string& title, int width_px, int height_px)
    : handles_(std::make_unique<Handles>(title, width_px, height_px)) {}

Window::Window(Window&&) noexcept = default;
Window::~Window() = default;

bool Window::begin_frame() {
  constexpr double longest_wait_s = 0.1;  // a click that was down and up within one frame still shows
  if (hurry_)
    glfwPollEvents();
  else
    glfwWaitEventsTimeout(longest_wait_s);
  hurry_ = false;
  GLFWwindow* window = handles_->window.get();
  if (glfwWindowShouldClose(window) == GLFW_TRUE) return false;
  handles_->pressed = std::exchange(handles_->arriving, {});
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  const ImGuiIO& io = ImGui::GetIO();
  if (handles_->was_pressed(GLFW_KEY_Q, true)) glfwSetWindowShouldClose(window, GLFW_TRUE);
  width_ = static_cast<int>(io.DisplaySize.x);
  height_ = static_cast<int>(io.DisplaySize.y);
  return true;
}

void Window::end_frame() {
  ImGui::Render();
  int width = 0, height = 0;
  glfwGetFramebufferSize(handles_->window.get(), &width, &height);
  glViewport(0, 0, width, height);
  glClearColor(0.09F, 0.09F, 0.1F, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  if (handles_->was_pressed(GLFW_KEY_F12, false)) write_screenshot();
  glfwSwapBuffers(handles_->window.get());
}

bool Window::pressed(char letter) const {
  return handles_->was_pressed(letter, false);
}

bool Window::held(char letter) const {
  return glfwGetKey(handles_->window.get(), letter) == GLFW_PRESS;
}

std::optional<Eigen::Vector2d> Window::pointer() const {
  const ImGuiIO& io = ImGui::GetIO();
  if (io.WantCaptureMouse || !ImGui::IsMousePosValid()) return std::nullopt;
  return Eigen::Vector2d(static_cast<double>(io.MousePos.x), static_cast<double>(io.MousePos.y));
}

void Window::write_screenshot() {
  int width = 0, height = 0;
  glfwGetFramebufferSize(handles_->window.get(), &width, &height);
  ImageU8 upside_down(width, height, 3), picture(width, height, 3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, upside_down.data.data());
  for (int y = 0; y < height; ++y)
    std::copy(upside_down.row(height - 1 - y).begin(), upside_down.row(height - 1 - y).end(), picture.row(y).begin());
  int number = 1;
  const auto name = [&] { return screenshot_folder_ / fmt::format("view_{:04}.png", number); };
  while (std::filesystem::exists(name())) ++number;
  try {
    write_png(name(), picture);
    notice_ = "wrote " + name().string();
  } catch (const InputError& e) {  // the window stays: the user may look on, and sees why
    notice_ = e.what();
  }
}

}  // namespace mf
