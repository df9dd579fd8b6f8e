// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "device/owned_fd.h"

namespace mf {

// A TCP socket that listens, non-blocking. `address`: IPv4 or IPv6; "::" takes both. `port` 0: any that is free.
// Throws InputError naming address and port: no address, not this machine's, in use, not allowed.
[[nodiscard]] OwnedFd listen_socket(const std::string& address, int port);
[[nodiscard]] int port_of(const OwnedFd&);

}  // namespace mf
