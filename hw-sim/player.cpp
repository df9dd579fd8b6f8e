// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/player.h"

#include "device/clock.h"
#include "hw-sim/sampler.h"
#include "hw-sim/wire_packing.h"

namespace mf::sim {

Player::Player(const Take& take, const SensorTraits& traits, std::uint64_t seed, Ending ending)
    : take_(&take), traits_(traits), seed_(seed), ending_(ending) {}

void Player::expose(const GigeShot& shot, std::span<std::uint8_t> into) {
  if (!sensor_ || response_ != shot.response || gain_db_ != shot.gain_db) {
    response_ = shot.response;
    gain_db_ = shot.gain_db;
    sensor_.emplace(traits_, response_, gain_db_);
  }
  const bool waving = begun_ && !ended();
  const PlayedFrame now{shot.number,
                        waving    ? next_ % take_->frames()
                        : ended() ? Take::without_mirror
                                  : waiting_frame_.load(),
                        clock_ns(CLOCK_MONOTONIC), shot.exposure_s};
  take_->light(now.take_frame, light_);
  codes_.resize(light_.data.size());
  sensor_->expose(light_, shot.exposure_s, mix(seed_, shot.number), codes_);
  pack(shot.format, codes_, into);
  if (waving) ++next_;
  const std::lock_guard lock(mutex_);
  played_.push_back(now);
}

std::vector<PlayedFrame> Player::played() const {
  const std::lock_guard lock(mutex_);
  return played_;
}

}  // namespace mf::sim
