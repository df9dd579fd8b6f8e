// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <string>

#include "device/owned_fd.h"

namespace mf::test {

// One connection to a web server on loopback, byte by byte: what a browser would never send, too.
class HttpClient {
 public:
  explicit HttpClient(int port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(fd_.get(), reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) fd_ = OwnedFd();
  }
  [[nodiscard]] int fd() const { return fd_.get(); }
  bool send(const std::string& bytes) {
    return ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  // What comes next; empty at the end or after `at_most`.
  [[nodiscard]] std::string some(std::chrono::milliseconds at_most = std::chrono::seconds(10)) {
    pollfd polled{fd_.get(), POLLIN, 0};
    if (::poll(&polled, 1, static_cast<int>(at_most.count())) <= 0) return {};
    std::array<char, 65536> bytes{};
    const ssize_t got = ::recv(fd_.get(), bytes.data(), bytes.size(), 0);
    return got > 0 ? std::string(bytes.data(), static_cast<std::size_t>(got)) : std::string();
  }
  [[nodiscard]] std::string everything() {
    std::string all;
    for (std::string more = some(); !more.empty(); more = some()) all += more;
    return all;
  }

 private:
  OwnedFd fd_;
};

}  // namespace mf::test
