// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "device/button.h"

namespace mf {

struct StartButtonOptions {
  std::string udev_tag = "mirrorfield-button";  // which udev/60-mirrorfield.rules gives
  std::string key;                              // the key that counts, as the kernel names it: KEY_RECORD; empty: any
  ButtonTiming timing;
};

// A start button that the kernel shows as an input device (evdev): keys on GPIO lines, a USB foot switch ... Every
// input device with the tag that has the key is read and grabbed, so that its keys reach nobody else; the button is
// down while any of them is. Throws InputError naming the option when options don't fit, or without libudev.
[[nodiscard]] std::unique_ptr<Button> open_start_button(const StartButtonOptions&);

}  // namespace mf
