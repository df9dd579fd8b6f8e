// SPDX-License-Identifier: Apache-2.0
#include "device/lamp.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>

#include "common/error.h"
#include "device/c_handle.h"
#include "device/owned_fd.h"

namespace mf {

namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using LampClock = std::chrono::steady_clock;

// Files of /sys are written as a whole by one write(). Returns 0 or the errno.
int write_attribute(const std::filesystem::path& file, const std::string& value) {
  const OwnedFd open(::open(file.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
  if (open.get() < 0) return errno;
  return ::write(open.get(), value.data(), value.size()) == static_cast<ssize_t>(value.size()) ? 0 : errno;
}

std::string full_brightness(const std::filesystem::path& led) {
  std::ifstream in(led / "max_brightness");
  int most = 0;
  return in >> most && most > 0 ? std::to_string(most) : "1";
}

}  // namespace

nanoseconds LampPattern::until_change(nanoseconds since) const {
  const nanoseconds phase = since % period;
  return (phase < on ? nanoseconds(on) : nanoseconds(period)) - phase;
}

LampPattern lamp_pattern(LampState state) {
  switch (state) {
    case LampState::idle:
      return {milliseconds(60), milliseconds(2000)};
    case LampState::recording:
      return {milliseconds(1000), milliseconds(1000)};
    case LampState::done:
      return {milliseconds(700), milliseconds(1400)};
    case LampState::error:
      break;
  }
  return {milliseconds(100), milliseconds(200)};
}

Lamp::Lamp(std::vector<LightSwitch> switches) : switches_(std::move(switches)), showing_(&Lamp::show, this) {}

Lamp::~Lamp() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  showing_.join();
}

void Lamp::set(LampState state) {
  {
    const std::lock_guard lock(mutex_);
    if (state == state_) return;
    state_ = state;
  }
  changed_.notify_all();
}

void Lamp::show() {
  std::unique_lock lock(mutex_);
  LampState shown = state_;
  LampClock::time_point began = LampClock::now();
  while (!ending_) {
    if (state_ != shown) {
      shown = state_;
      began = LampClock::now();
    }
    const LampPattern pattern = lamp_pattern(shown);
    const nanoseconds since = LampClock::now() - began;
    lock.unlock();
    for (const LightSwitch& light : switches_) light(pattern.lit(since));
    lock.lock();
    changed_.wait_until(lock, began + since + pattern.until_change(since), [&] { return ending_ || state_ != shown; });
  }
  for (const LightSwitch& light : switches_) light(false);
}

LightSwitch led_switch(const std::string& name, const std::filesystem::path& leds) {
  const std::filesystem::path led = leds / name;
  const bool plain_name = !name.empty() && name.find('/') == std::string::npos && name != "..";
  if (!plain_name || !std::filesystem::exists(led / "brightness"))
    throw InputError(led.string(), "", "is no lamp: name one of those in " + leds.string());
  const int error = write_attribute(led / "brightness", "0");
  if (error != 0)
    throw InputError((led / "brightness").string(), "",
                     fmt::format("cannot be written: {}: see udev/60-mirrorfield.rules", std::strerror(error)));
  // Or the kernel's own heartbeat blinks into it. Writing a brightness of 0 did that already where this may not be.
  (void)write_attribute(led / "trigger", "none");
  return
      [file = led / "brightness", on = full_brightness(led)](bool lit) { (void)write_attribute(file, lit ? on : "0"); };
}

}  // namespace mf
