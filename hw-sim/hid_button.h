// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

using UMockdevTestbed = struct _UMockdevTestbed;  // of umockdev.h  NOLINT(bugprone-reserved-identifier)

namespace mf::sim {

struct SimulatedHidButtonOptions {
  int vendor_id = 0x1209, product_id = 0x0001;  // pid.codes' test device
  std::string serial = "MF-BUTTON-1";
  int bus = 1, device = 7;  // its address
};

// A USB HID device with a button and a lamp that is no keyboard, in a umockdev testbed that outlives it: libusb talks
// to it through usbfs, as to a real one. Its reports have two bytes each way: bit 0 of byte 0 is the button on endpoint
// 0x81, bit 0 of byte 1 is the lamp, by SET_REPORT or on endpoint 0x02. Made unplugged; one thread at a time.
class SimulatedHidButton {
 public:
  SimulatedHidButton(UMockdevTestbed*, const SimulatedHidButtonOptions&);
  ~SimulatedHidButton();

  void plug_in(bool pressed = false);
  void unplug();
  // As SimulatedButton::contact.
  void contact(bool pressed, int bounces = 0);
  [[nodiscard]] bool lit() const;
  [[nodiscard]] int lamp_reports() const;  // that came
  [[nodiscard]] int resets() const;        // of its port

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mf::sim
