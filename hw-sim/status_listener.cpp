// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/status_listener.h"

#include <sys/socket.h>

#include <array>
#include <nlohmann/json.hpp>

#include "device/rig_status_json.h"

namespace mf::sim {

const RigStatus& StatusListener::latest() {
  if (!connection_.valid()) connection_ = connect_status_socket(socket_);
  if (!connection_.valid()) return status_;
  std::array<char, 65536> buffer;
  ssize_t got = 0;
  while ((got = ::recv(connection_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT)) > 0)
    unread_.append(buffer.data(), static_cast<std::size_t>(got));
  if (got == 0) connection_ = OwnedFd();
  const std::size_t end = unread_.rfind('\n');
  if (end == std::string::npos) return status_;
  const std::size_t before = end == 0 ? std::string::npos : unread_.rfind('\n', end - 1);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  status_ = rig_status_from_json(nlohmann::json::parse(unread_.substr(begin, end - begin)), socket_.string());
  unread_.erase(0, end + 1);
  return status_;
}

}  // namespace mf::sim
