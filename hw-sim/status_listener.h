// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "device/rig_status.h"
#include "device/status_socket.h"

namespace mf::sim {

// The latest status of a daemon, from its socket; connects when there is one to connect to.
class StatusListener {
 public:
  explicit StatusListener(std::filesystem::path socket) : socket_(std::move(socket)) {}

  // Reads what has come, without waiting.
  const RigStatus& latest();
  [[nodiscard]] bool connected() const { return connection_.valid(); }

 private:
  std::filesystem::path socket_;
  OwnedFd connection_;
  std::string unread_;
  RigStatus status_;
};

}  // namespace mf::sim
