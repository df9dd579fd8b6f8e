// SPDX-License-Identifier: Apache-2.0
#include "host/cli/command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace mf {

namespace {

class Bar {
 public:
  void show(std::string_view stage, double fraction) {
    const auto now = Clock::now();
    if (stage != stage_) {
      clear();
      stage_ = stage;
      started_ = last_ = now;
    }
    if (now - started_ < std::chrono::seconds(2)) return;
    if (fraction < 1 && now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    constexpr int width = 32;
    const int filled = static_cast<int>(fraction * width);
    fmt::print(stderr, "\r{:<24} [{:<{}}] {:3.0f} %", stage, std::string(static_cast<std::size_t>(filled), '#'), width,
               100 * fraction);
    std::fflush(stderr);
    visible_ = true;
    if (fraction >= 1) clear();
  }
  ~Bar() { clear(); }

 private:
  using Clock = std::chrono::steady_clock;
  void clear() {
    if (visible_) fmt::print(stderr, "\r{:<70}\r", "");
    visible_ = false;
  }
  std::string stage_;
  Clock::time_point started_;
  Clock::time_point last_;
  bool visible_ = false;
};

}  // namespace

void add_json_flag(CommandLine& command, bool& json) {
  command.flag("--json", json, "print what was measured as JSON");
}

void print_summary(bool json, const nlohmann::json& summary, const std::string& text) {
  if (json)
    fmt::print("{}\n", summary.dump(1));
  else
    fmt::print("{}", text);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Progress progress_bar() {
  if (isatty(STDERR_FILENO) == 0) return {};
  // Shared: std::function must be copyable, and every copy draws the same bar.
  return [bar = std::make_shared<Bar>()](std::string_view stage, double fraction) { bar->show(stage, fraction); };
}

}  // namespace mf
