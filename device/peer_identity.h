// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace mf {

// Who was at the other end of a Unix socket when it was connected, as the kernel knows it.
struct PeerIdentity {
  uid_t user = static_cast<uid_t>(-1);  // the kernel's "nobody known"
  pid_t process = 0;
  std::vector<gid_t> groups;  // with the supplementary ones

  [[nodiscard]] bool is_in(gid_t group) const;
};

// What could not be learnt stays unknown, and unknown users are in no group.
[[nodiscard]] PeerIdentity peer_identity(int socket);

// Throws InputError(where): there is no such group.
[[nodiscard]] gid_t group_id(const std::string& name, const std::string& where);

}  // namespace mf
