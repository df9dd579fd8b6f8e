// SPDX-License-Identifier: Apache-2.0
#include "tests/support/virtual_display.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "common/file_bytes.h"
#include "tests/support/run_command.h"

namespace mf::test {

namespace {

// A window dump (X11/XWDFile.h): 32-bit words, most significant byte first, then 12 bytes for each colour of a map,
// then rows of pixels as blue, green, red, unused.
ImageU8 decode_window_dump(const std::string& bytes) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(bytes.at(i)); };
  const auto word = [&](std::size_t i) {
    return static_cast<std::size_t>(byte(4 * i) << 24 | byte(4 * i + 1) << 16 | byte(4 * i + 2) << 8 | byte(4 * i + 3));
  };
  const std::size_t header = word(0), width = word(4), height = word(5), order = word(7), bits = word(11),
                    stride = word(12), colours = word(19);
  if (order != 0 || bits != 32) throw std::runtime_error("a window dump of another kind");
  ImageU8 screen(static_cast<int>(width), static_cast<int>(height), 3);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        screen.data[3 * (y * width + x) + c] = byte(header + 12 * colours + y * stride + 4 * x + 2 - c);
  return screen;
}

void pause_ms(int milliseconds) {
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

// Long enough that a busy machine's program sees one state before the next.
constexpr int step_ms = 150;

}  // namespace

bool VirtualDisplay::is_there() {
  return has_program("Xvfb") && has_program("xdotool");
}

VirtualDisplay::VirtualDisplay(int width, int height)
    : server_({"Xvfb", "-displayfd", "1", "-screen", "0", fmt::format("{}x{}x24", width, height), "-fbdir",
               memory_.path().string(), "-nolisten", "tcp"}) {
  if (const char* before = std::getenv("DISPLAY")) display_before_ = before;
  const std::string number = server_.first_line();
  if (number.empty()) throw std::runtime_error("Xvfb did not start");
  ::setenv("DISPLAY", (":" + number).c_str(), 1);
}

VirtualDisplay::~VirtualDisplay() {
  if (display_before_)
    ::setenv("DISPLAY", display_before_->c_str(), 1);
  else
    ::unsetenv("DISPLAY");
}

ImageU8 VirtualDisplay::screen() const {
  return decode_window_dump(read_file_bytes(memory_ / "Xvfb_screen0"));
}

bool VirtualDisplay::becomes(const std::function<bool(const ImageU8&)>& wanted) const {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  do {
    if (wanted(screen())) return true;
    pause_ms(step_ms);
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

void VirtualDisplay::xdotool(std::vector<std::string> arguments) const {
  arguments.insert(arguments.begin(), "xdotool");
  if (run_command(arguments).exit_code != 0) throw std::runtime_error("xdotool failed");
}

void VirtualDisplay::point_at(const Eigen::Vector2d& pixel) const {
  xdotool({"mousemove", std::to_string(std::lround(std::floor(pixel.x()))),
           std::to_string(std::lround(std::floor(pixel.y())))});
  pause_ms(step_ms);
}

void VirtualDisplay::click(const Eigen::Vector2d& pixel) const {
  drag({pixel});
}

void VirtualDisplay::drag(const std::vector<Eigen::Vector2d>& pixels) const {
  point_at(pixels.front());
  xdotool({"mousedown", "1"});
  pause_ms(step_ms);
  for (const Eigen::Vector2d& pixel : pixels) point_at(pixel);
  xdotool({"mouseup", "1"});
  pause_ms(step_ms);
}

void VirtualDisplay::scroll(Wheel way) const {
  xdotool({"click", std::to_string(static_cast<int>(way))});
  pause_ms(step_ms);
}

void VirtualDisplay::press(const std::string& key) const {
  xdotool({"key", key});
  pause_ms(step_ms);
}

void VirtualDisplay::hold_key(const std::string& key) const {
  xdotool({"keydown", key});
  pause_ms(step_ms);
}

void VirtualDisplay::release_key(const std::string& key) const {
  xdotool({"keyup", key});
  pause_ms(step_ms);
}

Eigen::Vector3i colour_at(const ImageU8& screen, const Eigen::Vector2d& pixel) {
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  return {screen.at(x, y, 0), screen.at(x, y, 1), screen.at(x, y, 2)};
}

}  // namespace mf::test
