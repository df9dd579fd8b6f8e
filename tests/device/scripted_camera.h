// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <set>

#include "common/session.h"
#include "device/camera_source.h"

namespace mf::test {

// What a camera without hardware does, numbered from frame 1.
struct Script {
  int frames = 0;
  std::chrono::milliseconds period{5};
  std::set<int> skipped;     // never told of
  std::set<int> incomplete;  // told of, but broken
  int dies_after = 0;        // frames; 0: never
  std::chrono::milliseconds dead_for{0};
};

// Goes on through the cameras that are opened one after the other.
struct ScriptRun {
  explicit ScriptRun(Script s) : script(std::move(s)), next_at(std::chrono::steady_clock::now()) {}
  Script script;
  int next = 1;
  bool died = false;
  std::atomic<bool> done = false;  // all frames were given
  std::chrono::steady_clock::time_point next_at;
  std::chrono::steady_clock::time_point back_at;
};

[[nodiscard]] CameraDescription scripted_description();
[[nodiscard]] ImageU16 scripted_codes(std::int64_t number);  // differ from frame to frame
[[nodiscard]] SessionHeader header_with_target();

// Features that a test puts there: numbers and choices keep what is written.
class ScriptedFeatures final : public FeatureAccess {
 public:
  std::map<std::string, double> numbers;
  std::map<std::string, std::string> choices;
  [[nodiscard]] bool has(const std::string& f) const override { return numbers.contains(f) || choices.contains(f); }
  [[nodiscard]] double number(const std::string& f) const override { return numbers.at(f); }
  void set_number(const std::string& f, double value) override { numbers.at(f) = value; }
  [[nodiscard]] std::string choice(const std::string& f) const override { return choices.at(f); }
  void set_choice(const std::string& f, const std::string& entry) override { choices.at(f) = entry; }
};

class ScriptedCamera final : public CameraSource {
 public:
  explicit ScriptedCamera(std::shared_ptr<ScriptRun> run);  // throws InputError while it is dead
  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  void start() override {}
  [[nodiscard]] Received receive(CameraFrame& into, std::chrono::milliseconds at_most) override;
  void set_exposure_s(double exposure_s) override { description_.exposure_s = exposure_s; }
  [[nodiscard]] FeatureAccess& features() override { return features_; }

 private:
  std::shared_ptr<ScriptRun> run_;
  CameraDescription description_;
  ScriptedFeatures features_;
};

}  // namespace mf::test
