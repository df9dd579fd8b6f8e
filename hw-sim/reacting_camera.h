// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hw-sim/gige_camera.h"
#include "hw-sim/sensor.h"

namespace mf::sim {

// Linear pictures, exposed anew each time they are sent, with the settings of that moment: what metering needs to see
// its effect. Give it to a GigeCamera: `[&](const GigeShot& s, auto into) { pictures.fill(s, into); }`.
class ReactingPictures {
 public:
  // Radiance, three channels or one, all of one size; played round and round. `traits.format` follows the shot's.
  // Keeps one float a pixel and picture, in the first format that is asked for.
  ReactingPictures(std::vector<ImageF> radiance, const SensorTraits&, std::uint64_t seed);

  // Any thread, one at a time. Precondition: `into` holds format.bytes_for() of the pictures' pixels.
  void fill(const GigeShot&, std::span<std::uint8_t> into);

 private:
  void prepare(const GigeShot&);
  std::vector<ImageF> radiance_;
  std::vector<ImageF> mosaics_;  // of radiance_, in traits_.format
  SensorTraits traits_;
  std::uint64_t seed_;
  std::optional<FastSensor> sensor_;  // of the settings below
  SensorResponse response_;
  double gain_db_ = 0;
  std::vector<std::uint16_t> codes_;
};

}  // namespace mf::sim
