// SPDX-License-Identifier: Apache-2.0
#include "device/button_logic.h"

#include <algorithm>

namespace mf {

const char* ButtonTiming::problem() const {
  using std::chrono::milliseconds;
  if (debounce < milliseconds(1) || debounce > milliseconds(1000)) return "the debounce time must lie from 1 ms to 1 s";
  if (hold <= debounce || hold > milliseconds(10'000))
    return "the hold time must be longer than the debounce time and at most 10 s";
  return "";
}

ButtonLogic::ButtonLogic(const ButtonTiming& timing)
    : debounce_ns_(std::chrono::nanoseconds(timing.debounce).count()),
      hold_ns_(std::chrono::nanoseconds(timing.hold).count()) {}

std::optional<ButtonEvent> ButtonLogic::contact(std::int64_t time_ns, bool pressed) {
  const std::optional<ButtonEvent> before = advance(time_ns);
  if (!seen_) {
    seen_ = true;
    press_ = pressed ? Press::ignored : Press::none;
    pressed_ = pressed;
    changed_ns_ = now_ns_;
  } else if (pressed != pressed_) {
    pressed_ = pressed;
    changed_ns_ = now_ns_;
  }
  return before;
}

std::optional<ButtonEvent> ButtonLogic::advance(std::int64_t time_ns) {
  now_ns_ = std::max(now_ns_, time_ns);
  return settle();
}

void ButtonLogic::unplugged() {
  seen_ = false;
  pressed_ = false;
  press_ = Press::none;
}

std::int64_t ButtonLogic::deadline_ns() const {
  if (!seen_) return never;
  if (pressed_ && press_ == Press::none) return changed_ns_ + debounce_ns_;
  if (pressed_ && press_ == Press::stopping) return std::max(press_began_ns_ + hold_ns_, changed_ns_);
  if (!pressed_ && press_ != Press::none) return changed_ns_ + debounce_ns_;
  return never;
}

std::optional<ButtonEvent> ButtonLogic::settle() {
  if (!seen_) return std::nullopt;
  const bool still = now_ns_ - changed_ns_ >= debounce_ns_;
  if (!pressed_) {
    if (still) press_ = Press::none;
    return std::nullopt;
  }
  if (press_ == Press::none && still) {
    press_began_ns_ = changed_ns_;
    press_ = recording_ ? Press::stopping : Press::ignored;
    if (recording_) return settle();  // time may have gone past the hold as well
    recording_ = true;
    return ButtonEvent::start;
  }
  if (press_ != Press::stopping || now_ns_ - press_began_ns_ < hold_ns_) return std::nullopt;
  press_ = Press::ignored;
  if (!recording_) return std::nullopt;  // it ended by itself meanwhile
  return ButtonEvent::stop;
}

}  // namespace mf
