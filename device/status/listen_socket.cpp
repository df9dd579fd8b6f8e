// SPDX-License-Identifier: Apache-2.0
#include "device/status/listen_socket.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "common/error.h"

namespace mf {

namespace {

struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;
};

SocketAddress parse_address(const std::string& text, int port) {
  SocketAddress address;
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  v4.sin_family = AF_INET;
  v6.sin6_family = AF_INET6;
  v4.sin_port = v6.sin6_port = htons(static_cast<std::uint16_t>(port));
  if (::inet_pton(AF_INET, text.c_str(), &v4.sin_addr) == 1) {
    std::memcpy(&address.storage, &v4, sizeof(v4));
    address.size = sizeof(v4);
  } else if (::inet_pton(AF_INET6, text.c_str(), &v6.sin6_addr) == 1) {
    std::memcpy(&address.storage, &v6, sizeof(v6));
    address.size = sizeof(v6);
  } else {
    throw InputError("status.address", "",
                     fmt::format("'{}' is no address: give one as 192.168.1.5, 0.0.0.0 or ::", text));
  }
  return address;
}

std::string why_not_listening(int error) {
  if (error == EADDRINUSE) return "is in use: stop who has it, or give another port";
  if (error == EADDRNOTAVAIL) return "is no address of this machine: give one that 'ip address' shows, or 0.0.0.0";
  if (error == EACCES) return "is not allowed to this user: give a port above 1023";
  return std::strerror(error);
}

}  // namespace

OwnedFd listen_socket(const std::string& address, int port) {
  const SocketAddress where = parse_address(address, port);
  const int family = where.storage.ss_family;
  OwnedFd fd(::socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int on = 1, off = 0;
  bool listens = fd.valid() && ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)) == 0;
  if (family == AF_INET6)
    listens = listens && ::setsockopt(fd.get(), IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof(off)) == 0;
  listens = listens && ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&where.storage), where.size) == 0 &&
            ::listen(fd.get(), 64) == 0;
  if (!listens) throw InputError(fmt::format("{} port {}", address, port), "", why_not_listening(errno));
  return fd;
}

int port_of(const OwnedFd& fd) {
  sockaddr_storage storage{};
  socklen_t size = sizeof(storage);
  if (::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&storage), &size) != 0) return 0;
  // The port stands at the same place for both families.
  return ntohs(reinterpret_cast<const sockaddr_in*>(&storage)->sin_port);
}

}  // namespace mf
