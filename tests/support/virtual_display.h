// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/image.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace mf::test {

// A screen of an X server that has none (Xvfb), with a pointer and a keyboard driven by xdotool. Windows lie at its
// upper left corner: there is no window manager. DISPLAY names it while it lives, for this process and its children.
class VirtualDisplay {
 public:
  [[nodiscard]] static bool is_there();  // both programs are installed
  // Throws std::runtime_error when it does not start.
  VirtualDisplay(int width, int height);
  VirtualDisplay(const VirtualDisplay&) = delete;
  VirtualDisplay& operator=(const VirtualDisplay&) = delete;
  ~VirtualDisplay();

  // What a person would see now, RGB: read from the server's memory, not from the program that drew it.
  [[nodiscard]] ImageU8 screen() const;
  // Until the screen is as wanted; false after 30 s.
  [[nodiscard]] bool becomes(const std::function<bool(const ImageU8&)>& wanted) const;

  void point_at(const Eigen::Vector2d& pixel) const;
  void click(const Eigen::Vector2d& pixel) const;
  // Left button down at the first, up at the last, with stops between.
  void drag(const std::vector<Eigen::Vector2d>& pixels) const;
  enum class Wheel { up = 4, down = 5 };
  void scroll(Wheel) const;
  // As xdotool names it: "F12", "ctrl+q", "b".
  void press(const std::string& key) const;
  void hold_key(const std::string& key) const;
  void release_key(const std::string& key) const;

 private:
  void xdotool(std::vector<std::string> arguments) const;

  TemporaryFolder memory_;
  std::optional<std::string> display_before_;
  ChildProcess server_;
};

// Red, green, blue of a screen's pixel.
[[nodiscard]] Eigen::Vector3i colour_at(const ImageU8& screen, const Eigen::Vector2d& pixel);

}  // namespace mf::test
