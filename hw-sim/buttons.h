// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

using UMockdevTestbed = struct _UMockdevTestbed;  // of umockdev.h  NOLINT(bugprone-reserved-identifier)

namespace mf::sim {

// Buttons without hardware, in a umockdev testbed that outlives them: whoever looks for them runs under
// `umockdev-wrapper` with the testbed's UMOCKDEV_DIR. All functions may be called from one thread at a time.

struct SimulatedButtonOptions {
  std::string node = "event5";             // of /dev/input
  std::string tag = "mirrorfield-button";  // as udev gives it; empty: none
  unsigned key = 167;                      // KEY_RECORD
  bool refuses_grab = false;               // as if another program held it
};

// An input device with one key. Made unplugged.
class SimulatedButton {
 public:
  SimulatedButton(UMockdevTestbed*, const SimulatedButtonOptions&);
  ~SimulatedButton();

  void plug_in(bool pressed = false);
  void unplug();
  // The contact closes or opens now, after `bounces` short returns of 1 to 3 ms (which this waits for).
  void contact(bool pressed, int bounces = 0);
  [[nodiscard]] bool grabbed() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mf::sim
