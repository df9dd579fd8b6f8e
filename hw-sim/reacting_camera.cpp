// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/reacting_camera.h"

#include "common/check.h"
#include "hw-sim/sampler.h"
#include "hw-sim/wire_packing.h"

namespace mf::sim {

ReactingPictures::ReactingPictures(std::vector<ImageF> radiance, const SensorTraits& traits, std::uint64_t seed)
    : radiance_(std::move(radiance)), traits_(traits), seed_(seed) {
  check(!radiance_.empty(), "there is a picture to show");
}

void ReactingPictures::prepare(const GigeShot& shot) {
  const bool same_format = !mosaics_.empty() && traits_.format == shot.format.format;
  if (sensor_ && same_format && response_ == shot.response && gain_db_ == shot.gain_db) return;
  traits_.format = shot.format.format;
  response_ = shot.response;
  gain_db_ = shot.gain_db;
  sensor_.emplace(traits_, response_, gain_db_);
  if (same_format) return;
  mosaics_.clear();
  for (const ImageF& picture : radiance_) mosaics_.push_back(sensor_mosaic(picture, traits_));
  codes_.resize(mosaics_.front().data.size());
}

void ReactingPictures::fill(const GigeShot& shot, std::span<std::uint8_t> into) {
  prepare(shot);
  sensor_->expose(mosaics_[(shot.number - 1) % mosaics_.size()], shot.exposure_s, mix(seed_, shot.number), codes_);
  pack(shot.format, codes_, into);
}

}  // namespace mf::sim
