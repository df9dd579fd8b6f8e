// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace mf::test {

// A headless Chromium with one page, driven through its DevTools protocol over a pipe. (--screenshot and --dump-dom
// wait for the end of an event stream, which never comes, and its window is never as narrow as a phone.)
class Chromium {
 public:
  struct Screen {
    int width = 360, height = 740;  // CSS pixels
    double pixels_per_css = 2;
    bool dark = false;
  };
  [[nodiscard]] static bool is_there();
  // Throws std::runtime_error when it does not start.
  explicit Chromium(const Screen&);
  ~Chromium();

  void open(const std::string& url);
  // The value of a JavaScript expression; a promise is waited for. Throws when it throws.
  nlohmann::json value(const std::string& expression);
  // Until the expression is true; false after 20 s.
  bool becomes(const std::string& expression);
  // A PNG of the whole page.
  void screenshot(const std::filesystem::path& file);
  // What went wrong in the page so far: exceptions, console.error, refused or missing resources.
  [[nodiscard]] const std::vector<std::string>& faults() const { return faults_; }

 private:
  nlohmann::json call(const std::string& method, const nlohmann::json& parameters);
  nlohmann::json receive();
  void take_event(const nlohmann::json&);

  TemporaryFolder profile_;
  int to_browser_ = -1, from_browser_ = -1;
  std::optional<ChildProcess> process_;
  std::string received_;
  std::string session_;
  int next_id_ = 1;
  std::vector<std::string> faults_;
};

}  // namespace mf::test
