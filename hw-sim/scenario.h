// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "hw-sim/sensor.h"
#include "hw-sim/take.h"

namespace mf::sim {

enum class FaultKind {
  packet_loss,   // `amount` of the packets get lost at first, for `seconds`
  camera_death,  // the camera falls silent, and has booted anew after `seconds`
  skipped,       // `amount` frames are taken, but never sent
  jitter,        // frames leave up to `amount` seconds late, for `seconds`
  slow_disk,     // every write and sync takes `amount` seconds longer, for `seconds`
  full_disk,     // writes find no space left, for `seconds`
  io_error,      // `amount` writes or syncs fail (0: all of them), for `seconds`
  knock,         // the button is touched for a moment, with bounces
  replug,        // the button is unplugged, and plugged in again after `seconds`
};

[[nodiscard]] std::string_view fault_name(FaultKind);

struct Fault {
  FaultKind kind = FaultKind::packet_loss;
  double at_s = 0;  // after the first recorded frame of the waving mirror
  double seconds = 0;
  double amount = 0;
};

// One recording without hardware, on one timeline.
struct Scenario {
  int size_px = 512;                       // edge of a frame
  TakeOptions take;                        // with the seed of everything
  std::filesystem::path panorama;          // OpenEXR, the distant surroundings; empty: a hall with windows
  std::string pixel_format = "BayerRG12";  // on the wire (device/pixel_packing.h)
  SensorTraits sensor;
  std::string address = "127.0.0.37";  // where the camera answers
  double frame_rate_hz = 37;
  double exposure_s = 0.01;   // that the camera wakes up with
  double packet_loss = 0;     // all the time
  double clock_ppm = 0;       // how much faster than the host's the camera's clock runs
  double lead_s = 2.5;        // the camera runs for so long before the button is pressed
  double tail_s = 0.5;        // and after the last frame of the mirror, before it is held down to stop
  std::string rig_config;     // TOML that is added to the daemon's config, as it stands
  std::vector<Fault> faults;  // by their time
};

// scenario.toml (docs/simulator.md). Throws InputError naming file, table and key.
[[nodiscard]] Scenario read_scenario(const std::filesystem::path&);

}  // namespace mf::sim
