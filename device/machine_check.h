// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "device/button.h"

namespace mf {

// What was looked at, one line with the figure; when it isn't ok, what to do.
struct Finding {
  enum class Level { ok, warning, error };
  std::string what;
  Level level = Level::ok;
  std::string remedy;  // empty when ok
};

struct MachineCheckOptions {
  // What the rig is.
  bool gige = false, usb = false;              // its camera; both while nobody knows
  std::string camera_address;                  // IPv4 of a GigE camera; empty: unknown
  int packet_bytes = 1400;                     // GigE
  int socket_buffer_bytes = 16 * 1024 * 1024;  // GigE
  std::filesystem::path video_node;            // of a V4L2 camera; empty: none
  std::filesystem::path recordings;            // folder
  double bytes_per_second = 40e6;              // of a recording; an estimate will do
  // Where the machine shows itself.
  std::filesystem::path proc = "/proc", sys = "/sys", dev = "/dev";
  std::function<bool()> clock_is_set;  // by the network; empty: the kernel is asked
};

// What is wrong with this machine for a recording, and what is not. Changes nothing: how fast the disk makes things
// durable is measured with an unnamed file. Never throws for what it finds.
[[nodiscard]] std::vector<Finding> check_machine(const MachineCheckOptions&);

// Whether the config is read, and the button is there, as findings.
[[nodiscard]] Finding check_config(const std::filesystem::path& config);
[[nodiscard]] Finding check_button(const Button&);

// As a person reads it: "warning: WHAT: REMEDY".
[[nodiscard]] std::string finding_line(const Finding&);

}  // namespace mf
