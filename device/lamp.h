// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace mf {

// What the rig's lamp says without a screen.
enum class LampState {
  idle,       // a short flash every two seconds: it is alive and waits for the button
  recording,  // on; from the first durable frame only
  done,       // slow blink: the recording is closed, all of it is durable
  error,      // fast blink
};

// Lit for the first `on` of each `period`.
struct LampPattern {
  std::chrono::milliseconds on, period;

  [[nodiscard]] bool lit(std::chrono::nanoseconds since) const { return since % period < on; }
  // How long it stays as it is `since` the pattern began; at most a period.
  [[nodiscard]] std::chrono::nanoseconds until_change(std::chrono::nanoseconds since) const;
};
[[nodiscard]] LampPattern lamp_pattern(LampState);

// Lights one lamp, or puts it out. Must neither wait nor throw; one that cannot, because it was unplugged, does
// nothing.
using LightSwitch = std::function<void(bool lit)>;

// Shows a state on all lamps of the rig, in a thread of its own, so that it goes on blinking whatever the rest does.
// Off when destroyed.
class Lamp {
 public:
  explicit Lamp(std::vector<LightSwitch> switches);
  Lamp(const Lamp&) = delete;
  Lamp& operator=(const Lamp&) = delete;
  ~Lamp();

  void set(LampState);  // from any thread; shown at once. The same state again does not start its pattern anew

 private:
  void show();

  std::vector<LightSwitch> switches_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  LampState state_ = LampState::idle;
  bool ending_ = false;

  std::thread showing_;
};

// A lamp that the kernel shows in /sys/class/leds: takes it from its trigger and writes its brightness. Throws
// InputError naming the file when there is no such lamp or it may not be written.
[[nodiscard]] LightSwitch led_switch(const std::string& name, const std::filesystem::path& leds = "/sys/class/leds");

}  // namespace mf
