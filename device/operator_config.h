// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "device/config_table.h"
#include "device/hid_button.h"
#include "device/start_button.h"

namespace mf {

// What the operator presses and sees: tables [button], [hid_button] and [lamp] of mirrorfieldd.toml.
struct OperatorConfig {
  std::optional<StartButtonOptions> button;  // there is a table [button], be it empty
  std::optional<HidButtonOptions> hid_button;
  std::string led;  // of /sys/class/leds; empty: none
};

// Throws InputError naming the key: a wrong type or range, both kinds of button.
[[nodiscard]] OperatorConfig read_operator_config(const toml::table& root, const std::string& file);

}  // namespace mf
