// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "hw-sim/gige_camera.h"
#include "hw-sim/take.h"

namespace mf::sim {

// Which frame of the take a camera's frame showed, and how it was set.
struct PlayedFrame {
  std::uint64_t number = 0;  // the camera's count over its whole life
  int take_frame = Take::without_mirror;
  std::int64_t monotonic_ns = 0;  // CLOCK_MONOTONIC when it was exposed
  double exposure_s = 0;
};

// Plays a take through a camera: the lamp in the mirror, which is then put aside; the still scene, until begin(); then
// the mirror's frames one after the other; then the still scene again. Give it to a GigeCamera: `[&](const GigeShot& s,
// auto into) { player.expose(s, into); }`.
class Player {
 public:
  enum class Ending { still_scene, again };  // what comes after the last frame of the mirror
  // The take outlives it.
  Player(const Take&, const SensorTraits&, std::uint64_t seed, Ending = Ending::still_scene);

  void expose(const GigeShot&, std::span<std::uint8_t> into);
  void put_mirror_aside() { waiting_frame_ = Take::without_mirror; }
  void begin() { begun_ = true; }
  [[nodiscard]] bool ended() const { return ending_ == Ending::still_scene && next_ >= take_->frames(); }
  [[nodiscard]] std::vector<PlayedFrame> played() const;

 private:
  const Take* take_;
  SensorTraits traits_;
  std::uint64_t seed_;
  Ending ending_;
  std::atomic<bool> begun_ = false;
  std::atomic<int> waiting_frame_ = Take::lamp_shown;
  std::atomic<int> next_ = 0;
  // The camera's thread's own.
  std::optional<FastSensor> sensor_;
  SensorResponse response_;
  double gain_db_ = 0;
  ImageF light_;
  std::vector<std::uint16_t> codes_;

  mutable std::mutex mutex_;
  std::vector<PlayedFrame> played_;
};

}  // namespace mf::sim
