// SPDX-License-Identifier: Apache-2.0
#include "device/peer_identity.h"

#include <grp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>

#include "common/error.h"

namespace mf {

bool PeerIdentity::is_in(gid_t group) const {
  return std::find(groups.begin(), groups.end(), group) != groups.end();
}

PeerIdentity peer_identity(int socket) {
  PeerIdentity peer;
  ucred credentials{};
  socklen_t size = sizeof(credentials);
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return peer;
  peer.user = credentials.uid;
  peer.process = credentials.pid;
  peer.groups.push_back(credentials.gid);
  std::array<gid_t, 1024> supplementary{};  // beyond so many the kernel gives none, and the own one must do
  size = sizeof(supplementary);
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, supplementary.data(), &size) == 0)
    peer.groups.insert(peer.groups.end(), supplementary.begin(),
                       supplementary.begin() + static_cast<std::ptrdiff_t>(size / sizeof(gid_t)));
  return peer;
}

gid_t group_id(const std::string& name, const std::string& where) {
  group entry{};
  group* found = nullptr;
  std::vector<char> text(65536);
  if (::getgrnam_r(name.c_str(), &entry, text.data(), text.size(), &found) != 0 || found == nullptr)
    throw InputError(where, "", "there is no group '" + name + "': create it, or name another");
  return found->gr_gid;
}

}  // namespace mf
