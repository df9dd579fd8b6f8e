// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "device/button_logic.h"

namespace mf {

// The hardware seam: the rig's one button. A button that vanishes and returns is no error. One thread at a time.
class Button {
 public:
  Button() = default;
  Button(const Button&) = delete;
  Button& operator=(const Button&) = delete;
  virtual ~Button() = default;

  // What the operator asked for, if anything; waits for it no longer than `at_most`.
  [[nodiscard]] virtual std::optional<ButtonEvent> poll(std::chrono::milliseconds at_most) = 0;
  // As ButtonLogic::set_recording.
  virtual void set_recording(bool recording) = 0;
  [[nodiscard]] virtual bool present() const = 0;
  // Why a button that is plugged in cannot be read, one line with the remedy; empty: nothing is wrong.
  [[nodiscard]] virtual std::string problem() const = 0;
};

}  // namespace mf
