// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "device/button.h"

namespace mf {

// Where the lamp is in a report that is sent to the button.
struct HidLampOptions {
  std::vector<std::uint8_t> report;  // as it is sent with the lamp off, its number first when reports have one
  int byte = 0;                      // of it
  int mask = 1;                      // bits of that byte that are set when the lamp is lit; 1 to 255
  int endpoint = 0;                  // an interrupt OUT endpoint, 0x01 to 0x0f; 0: SET_REPORT over the control pipe
  std::optional<int> report_id;      // for SET_REPORT, 1 to 255; none: reports have no numbers
};

struct HidButtonOptions {
  int vendor_id = 0, product_id = 0;  // of USB; needed
  int interface_number = 0;
  int endpoint = 0x81;              // the interrupt IN endpoint that tells of the button, 0x81 to 0x8f
  int report_bytes = 8;             // the longest report of that endpoint, 1 to 1024
  std::optional<int> report_id;     // only reports that begin with this byte tell of the button; none: all do
  int button_byte = 0;              // of the report
  int button_mask = 1;              // bits of that byte, 1 to 255: pressed while any of them is set ...
  bool pressed_when_clear = false;  // ... or while none is
  std::optional<HidLampOptions> lamp;
  ButtonTiming timing;

  [[nodiscard]] std::string problem() const;  // what is wrong with it, one line; empty: nothing
};

class HidButton : public Button {
 public:
  // The lamp in the button; nothing without one. From any thread; it is lit when poll() comes by, and a button that is
  // plugged in later is told then.
  virtual void light(bool lit) = 0;
};

// A USB button that is no keyboard, read and lit through libusb; the kernel's own driver is sent off it. The first
// device with these numbers is taken. Throws InputError when options don't fit, or without libusb.
[[nodiscard]] std::unique_ptr<HidButton> open_hid_button(const HidButtonOptions&);

}  // namespace mf
