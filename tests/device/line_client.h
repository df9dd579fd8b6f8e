// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "device/status_socket.h"

namespace mf::test {

// A program that reads the daemon's socket line by line.
class LineClient {
 public:
  explicit LineClient(const std::filesystem::path& path) : fd_(connect_status_socket(path)) {}

  [[nodiscard]] bool connected() const { return fd_.valid(); }
  // Nothing when none comes in time, or the connection ended.
  [[nodiscard]] std::optional<std::string> line(std::chrono::milliseconds at_most = std::chrono::seconds(10)) {
    if (!fd_.valid()) return std::nullopt;
    const auto until = std::chrono::steady_clock::now() + at_most;
    for (std::size_t end = 0; (end = received_.find('\n')) == std::string::npos;) {
      const auto left = until - std::chrono::steady_clock::now();
      pollfd polled{fd_.get(), POLLIN, 0};
      const auto ms = std::chrono::ceil<std::chrono::milliseconds>(left).count();
      if (ms <= 0 || ::poll(&polled, 1, static_cast<int>(ms)) <= 0) return std::nullopt;
      std::array<char, 65536> bytes{};
      const ssize_t got = ::recv(fd_.get(), bytes.data(), bytes.size(), 0);
      if (got <= 0) ended_ = true;
      if (got <= 0) return std::nullopt;
      received_.append(bytes.data(), static_cast<std::size_t>(got));
    }
    const std::size_t end = received_.find('\n');
    std::string line = received_.substr(0, end);
    received_.erase(0, end + 1);
    return line;
  }
  // The next answer; status lines on the way are passed over.
  [[nodiscard]] std::string answer() {
    while (const std::optional<std::string> text = line())
      if (text->find("\"answer\"") != std::string::npos) return *text;
    return {};
  }
  bool send(const std::string& text) {
    return ::send(fd_.get(), text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  OwnedFd fd_;
  std::string received_;
  bool ended_ = false;
};

}  // namespace mf::test
