// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "device/owned_fd.h"
#include "device/rig_status.h"

namespace mf {

struct StartAnswer {
  int number = 0;  // of the request, from 1
  bool accepted = false;
  std::string reason;  // why not
};

// What is known of the rig at a moment.
struct RigNews {
  bool connected = false;
  std::string problem;  // why it is not, one line
  // The last status, also of a daemon that has gone since.
  std::shared_ptr<const RigStatus> status;
  std::chrono::steady_clock::time_point status_at;
  std::optional<StartAnswer> start_answer;  // to the last request of ours
};

struct RigLinkOptions {
  std::filesystem::path socket;
  std::chrono::milliseconds retry_each{500};  // while nobody serves it; > 0
  std::chrono::milliseconds tick{1000};       // news at least so often, so that ages go on; > 0
};

// Reads the daemon's socket in a thread of its own, and connects again whenever it must. A daemon that is not there,
// or that speaks what we cannot read, is news, not an error.
class RigLink {
 public:
  // Throws InputError: no path for a socket.
  explicit RigLink(const RigLinkOptions&);
  RigLink(const RigLink&) = delete;
  RigLink& operator=(const RigLink&) = delete;
  ~RigLink();

  // Once. `on_news` runs here for what is known now, later in that thread, and not after stop().
  void start(std::function<void(const RigNews&)> on_news);
  void stop();
  // False: the daemon is not there. The answer is news.
  [[nodiscard]] bool request_start(const std::string& token);

 private:
  void run();
  void connect();
  void disconnect(const std::string& why);
  void read_lines();
  void take_line(const std::string& line);
  void send_start();
  void ring() const;

  RigLinkOptions options_;
  std::function<void(const RigNews&)> on_news_;
  OwnedFd bell_;

  // The thread's own.
  OwnedFd fd_;
  std::string received_;
  RigNews news_;

  std::mutex mutex_;  // guards what follows
  bool stopping_ = false;
  bool connected_ = false;
  std::optional<std::string> start_;  // a token on its way

  std::thread thread_;
};

}  // namespace mf
