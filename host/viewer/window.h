// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/image.h"

namespace mf {

// A window with OpenGL 3.3 and Dear ImGui in it; one a process, on the main thread.
//
//   Window window("name", 1280, 800);
//   while (window.begin_frame()) {
//     … panels and pictures (drawing.h) …
//     window.end_frame();
//   }
//
// Keys of every window: Ctrl+Q closes it, F12 writes a screenshot.
class Window {
 public:
  // Throws InputError naming the display when there is none, or no OpenGL 3.3 on it.
  Window(const std::string& title, int width_px, int height_px);
  Window(Window&&) noexcept;
  Window& operator=(Window&&) = delete;
  ~Window();

  // Waits for something to happen, 0.1 s at most (not at all when the last frame said `hurry`). False: it was closed.
  [[nodiscard]] bool begin_frame();
  void end_frame();

  // The next frame follows at once: something moves, or a better picture is on its way.
  void hurry() { hurry_ = true; }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  // Where the pointer is; nothing while it is over a panel or outside.
  [[nodiscard]] std::optional<Eigen::Vector2d> pointer() const;

  // A letter's key ('A' to 'Z'): went down without Ctrl since the last frame (however short), and is down now.
  [[nodiscard]] bool pressed(char letter) const;
  [[nodiscard]] bool held(char letter) const;

  // F12 writes view_0001.png, view_0002.png, … there; names that exist are left alone.
  void keep_screenshots_in(const std::filesystem::path& folder) { screenshot_folder_ = folder; }
  // A line for the user about the last thing done; empty when there was none.
  [[nodiscard]] const std::string& notice() const { return notice_; }
  void set_notice(std::string notice) { notice_ = std::move(notice); }

 private:
  struct Handles;
  void write_screenshot();

  std::unique_ptr<Handles> handles_;
  int width_ = 0, height_ = 0;
  bool hurry_ = false;
  std::filesystem::path screenshot_folder_ = ".";
  std::string notice_;
};

}  // namespace mf
