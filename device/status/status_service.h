// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "device/status/page_server.h"
#include "device/status/rig_link.h"
#include "device/status_config.h"

namespace mf {

// The whole program: from the daemon's socket to browsers. Runs in two threads of its own until it is destroyed.
class StatusService {
 public:
  // Throws InputError: address, port or token file of the config.
  explicit StatusService(const StatusConfig&);
  StatusService(const StatusService&) = delete;
  StatusService& operator=(const StatusService&) = delete;
  ~StatusService();

  [[nodiscard]] int port() const { return server_.port(); }

 private:
  PageTextMaker texts_;
  RigLink link_;
  PageServer server_;
};

// The pairing word in a file. Throws InputError naming it: missing, too short or long, open to every user.
[[nodiscard]] std::string read_pairing_token(const std::filesystem::path&);

}  // namespace mf
