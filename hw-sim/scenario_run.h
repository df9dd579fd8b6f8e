// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "common/progress.h"
#include "device/rig_status.h"
#include "hw-sim/gige_camera.h"
#include "hw-sim/scenario.h"

namespace mf::sim {

// What the simulated button and V4L2 camera are seen through: to be preloaded by who makes and by who uses them.
inline constexpr const char* umockdev_library = "libumockdev-preload.so.0";

struct ScenarioResult {
  RigStatus last;                 // what the daemon told last
  GigeCameraCounts camera;        // what was sent
  int daemon_exit_code = 0;       // after SIGTERM
  double first_durable_s = 0;     // from the press to the first durable frame
  std::filesystem::path session;  // what was recorded
};

struct ScenarioFiles {
  std::filesystem::path folder;  // is made: rig.toml, target.json, world.json, the session, truth/
  std::filesystem::path daemon;  // mirrorfieldd
};

// Starts all of it, presses the button, waves the mirror, lets happen what the scenario says, holds the button to stop,
// and ends the daemon. Beside the session it writes truth/ (docs/simulator.md): what `mirrorfield-sim capture` writes
// there, and played.json, which frame of the take each of the camera's frames showed. `say` hears of each event.
//
// Must run with umockdev's preload library (has_umockdev()): the button is an input device that is not there.
// Throws InputError: the folder exists, the camera's address is taken, the daemon does not start or tells nothing.
[[nodiscard]] ScenarioResult run_scenario(const Scenario&, const ScenarioFiles&, const Progress&,
                                          const std::function<void(const std::string&)>& say);

}  // namespace mf::sim
