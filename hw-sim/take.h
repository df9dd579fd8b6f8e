// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/image.h"
#include "common/progress.h"
#include "common/rigid3.h"
#include "hw-sim/desk_rig.h"
#include "hw-sim/sensor.h"

namespace mf::sim {

struct TakeOptions {
  int frames = 120;        // of the waving mirror, ≥ 10
  int samples = 5;         // paths a pixel in frames, ≥ 1
  int scene_samples = 48;  // and in the picture of the scene without the mirror
  double blur = 0;         // share of the time between two frames in which the shutter is open, 0 to 1: motion blur
  std::uint64_t seed = 1;

  // What is wrong, or nothing.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// What the rig's camera sees of one waving of the mirror, as light, before any sensor: traced once, then exposed as
// often as a camera sends it.
class Take {
 public:
  static constexpr int without_mirror = -1;
  static constexpr int lamp_shown = -2;  // the mirror, held so that the camera sees the lamp in it: to be metered

  // Throws InputError for options that are wrong.
  Take(const DeskRig&, const TakeOptions&, const SensorTraits&, const Progress&);

  [[nodiscard]] int frames() const { return static_cast<int>(patches_.size()); }
  // world_from_mirror in the middle of the exposure.
  [[nodiscard]] const std::vector<Rigid3>& poses() const { return poses_; }
  // The scene without the mirror, three channels of radiance, without the lens' vignetting.
  [[nodiscard]] const ImageF& scene() const { return scene_; }
  // What reaches the sensor's pixels (sensor_mosaic()). Precondition: −2 ≤ frame < frames(). Cheap: a copy.
  void light(int frame, ImageF& into) const;

 private:
  struct Patch {
    Region region;
    ImageF light;  // of the region's pixels
  };
  [[nodiscard]] static Patch trace(const DeskRig&, const Shot&, const SensorTraits&);
  ImageF scene_;
  ImageF still_;  // its mosaic
  Patch lamp_;
  std::vector<Rigid3> poses_;
  std::vector<Patch> patches_;  // where the mirror changes it
};

}  // namespace mf::sim
