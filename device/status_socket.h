// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "device/owned_fd.h"
#include "device/rig_status.h"

namespace mf {

struct StatusSocketOptions {
  std::filesystem::path path = "/run/mirrorfield/status.sock";
  std::string group;          // the socket's, whose members may ask for a start; empty: the process's own
  bool accept_start = false;  // off: every request for a start is refused
  int most_clients = 16;      // one more is turned away; ≥ 1
  std::chrono::milliseconds least_interval{100};     // between two lines to a client; ≥ 0
  std::chrono::milliseconds longest_blockage{5000};  // a client that takes nothing for so long is dropped; > 0
};

// Somebody asks for a recording.
struct StartRequest {
  std::string token;  // as it was given; who may ask at all is judged here, the word from the network by the page
  uid_t user = 0;     // of the process that asked
  pid_t process = 0;
};

// Tells the rig's status to programs on the same machine: a Unix stream socket (mode 0660), lines of JSON
// (rig_status_json.h; the preview at most 256 pixels wide and high). Every client gets the latest status at once and
// then each new one; one that reads slowly misses some. A thread of its own serves them, and nothing here waits.
//
// A client may send one command, {"command": "start", "token": "…"} and a line feed. It is answered by a line
//   {"answer": "start", "accepted": true, "reason": ""}
// between the status lines; accepted means handed on. It is refused, with the reason, when accept_start is off, the
// client is neither root, nor the daemon's user, nor of `group` (the kernel says: SO_PEERCRED, SO_PEERGROUPS), while
// the rig measures light or records, and while another request waits. Any other line is answered in the same way;
// one of over 4 kB ends the connection.
class StatusSocket {
 public:
  // Replaces a socket that nobody serves any more. Throws InputError: the folder is missing or not writable, the path
  // is no socket or too long, another process serves it, there is no such group.
  explicit StatusSocket(const StatusSocketOptions&);
  StatusSocket(const StatusSocket&) = delete;
  StatusSocket& operator=(const StatusSocket&) = delete;
  ~StatusSocket();

  void publish(RigStatus);
  // What was asked for since the last call. A request older than 5 s is forgotten: nobody expects it to act any more.
  [[nodiscard]] std::optional<StartRequest> take_start_request();
  [[nodiscard]] int clients() const;

 private:
  struct Server;
  std::unique_ptr<Server> server_;
};

// A connection to the socket; invalid when nobody serves it, with errno set. Does not block, now or later.
[[nodiscard]] OwnedFd connect_status_socket(const std::filesystem::path&);

}  // namespace mf
