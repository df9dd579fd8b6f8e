// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace mf {

class ConfigTable;

// Table [status] of mirrorfieldd.toml (docs/status.md): how the rig tells of itself. The daemon and the page read it.
struct StatusConfig {
  std::filesystem::path socket = "/run/mirrorfield/status.sock";
  std::string group;  // may read the socket, and ask for a start through it; empty: as the file system gives it
  std::string address = "0.0.0.0";      // of the page: of one network of this machine, or of all (0.0.0.0, ::)
  int port = 8080;                      // of the page; 0: any that is free
  std::vector<std::string> host_names;  // by which browsers may ask for it, beside addresses and this machine's name
  bool remote_start = false;            // a recording may be started from the page
  std::filesystem::path token_file;     // the word that the page must know for that; needed when remote_start is on
};

// Throws InputError.
[[nodiscard]] StatusConfig read_status_config(ConfigTable);
[[nodiscard]] StatusConfig read_status_config(const std::filesystem::path& file);

}  // namespace mf
