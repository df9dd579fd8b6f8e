// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace mf {

// A device on USB by what it says of itself; 0 and empty leave that open.
struct UsbDeviceName {
  int vendor_id = 0, product_id = 0;
  std::string serial;
};

struct UsbResetOutcome {
  enum class Result {
    done,     // it answers again, or comes back as if plugged in anew
    absent,   // no such device is plugged in
    refused,  // see why
  };
  Result result = Result::absent;
  std::string why;  // one line with the remedy; empty unless refused
};

// Resets a device's USB port, which brings back a camera that hangs. Nobody may hold it open meanwhile but who will
// open it anew. The serial number is the one that the kernel read when it was plugged in: a device that hangs is not
// asked. A name that fits several devices is refused, and so is one that leaves everything open.
[[nodiscard]] UsbResetOutcome reset_usb_device(const UsbDeviceName&);

}  // namespace mf
