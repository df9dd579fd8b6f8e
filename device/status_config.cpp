// SPDX-License-Identifier: Apache-2.0
#include "device/status_config.h"

#include "device/config_table.h"

namespace mf {

StatusConfig read_status_config(ConfigTable table) {
  StatusConfig c;
  c.socket = table.path("socket").value_or(c.socket);
  c.group = table.text("group").value_or(c.group);
  c.address = table.text("address").value_or(c.address);
  c.port = table.integer("port", 0, 65535).value_or(c.port);
  c.host_names = table.texts("host_names").value_or(c.host_names);
  c.remote_start = table.flag("remote_start").value_or(c.remote_start);
  c.token_file = table.path("token_file").value_or(c.token_file);
  table.refuse_unknown_keys();
  if (c.remote_start && c.token_file.empty())
    table.fail("token_file", "is missing: remote_start needs it, a file with the word that the page must know");
  return c;
}

StatusConfig read_status_config(const std::filesystem::path& file) {
  const toml::table root = read_config_file(file);
  return read_status_config(ConfigTable(root, "status", file.string()));
}

}  // namespace mf
