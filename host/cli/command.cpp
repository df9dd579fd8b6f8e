// SPDX-License-Identifier: Apache-2.0
#include "host/cli/command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "common/error.h"

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

void check_folder_of(const std::filesystem::path& output) {
  const std::filesystem::path folder = output.parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw InputError(output.string(), "", "cannot be written: " + folder.string() + " is no folder; create it first");
}

void check_exr_output(const std::string& command, const std::string& flag, const std::filesystem::path& output) {
  if (output.extension() != ".exr") throw InputError(command, flag, "'" + output.string() + "' must end in .exr");
  check_folder_of(output);
}

Progress progress_bar() {
  if (isatty(STDERR_FILENO) == 0) return {};
  // Shared: std::function must be copyable, and every copy draws the same bar.
  return [bar = std::make_shared<Bar>()](std::string_view stage, double fraction) { bar->show(stage, fraction); };
}

}  // namespace mf
