// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "common/camera_model.h"
#include "common/mirror_target.h"
#include "common/rigid3.h"

namespace mf {

// Buehler's field-of-view weight of a mirror's view: 1 inside, falling smoothly to 0 towards the opening's edge and the
// picture's border; 0 on the tag frame.
struct BorderOptions {
  double border_fraction = 0.12;  // width of the smooth border, of the opening's shorter side; 0 to 0.5
  double inset_px = 2;  // kept clear of the tag frame beyond that: demosaicing and calibration reach over edges
};

class ViewBorder {
 public:
  // `scale`: level-0 pixels per camera pixel.
  ViewBorder(const CameraModel&, const MirrorTarget&, const Rigid3& cam_from_mirror, const BorderOptions&,
             double scale);

  // Weights of level-0 pixels x0 + i of row y (undistorted, of the whole picture). `u`, `v`: where each lies in the
  // picture as taken, camera pixels.
  void weigh_row(int x0, int y, std::span<const float> u, std::span<const float> v, std::span<float> weights) const;

 private:
  Eigen::Matrix3f mirror_from_pixel_;  // undistorted level-0 pixel (x, y, 1) → (x·w, y·w, w) on the mirror, metres
  Eigen::Vector2f half_opening_;
  Eigen::Vector2f picture_;  // camera pixels
  float border_m_;
  float inset_px_;
  float scale_;
};

}  // namespace mf
