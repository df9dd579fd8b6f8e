// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/progress.h"
#include "host/calibration/calibration.h"
#include "host/calibration/target_view.h"

namespace mf {

enum class DistortionChoice {
  automatic,  // starts from full and drops what the pictures don't show beyond five standard deviations
  none,
  radial,  // k1 k2
  brown,   // k1 k2 p1 p2
  full,    // k1 k2 p1 p2 k3
};
[[nodiscard]] std::string distortion_choice_name(DistortionChoice);
[[nodiscard]] std::optional<DistortionChoice> parse_distortion_choice(std::string_view name);

struct CalibrationOptions {
  DistortionChoice distortion = DistortionChoice::automatic;
  bool square_pixels = false;           // fx = fy
  double ransac_threshold_px = 12;      // > 0; wide, for lens distortion is not known yet
  double model_error_px = 0.02;         // > 0: what printing and flatness of the tags add to every corner's noise
  double max_rotation_sigma_deg = 0.1;  // > 0: a frame whose pose is less certain is not used
  double max_position_sigma_m = 0.001;  // > 0
  int threads = 0;                      // 0: as many as the machine has

  [[nodiscard]] std::optional<std::string> validate() const;
};

struct CalibrationInput {
  std::string source;  // the session, for messages
  int width = 0;       // pixels
  int height = 0;
  std::vector<TargetView> mirror;  // every mirror frame, also those without tags
  TargetView world;                // the scene's own tags in all scene pictures together (the camera stands still)
};

struct CalibrationResult {
  Calibration calibration;
  int tags = 0;             // seen in mirror frames
  int outlier_tags = 0;     // of these, disagreeing with their frame's pose
  double noise_factor = 1;  // actual over predicted standard deviation of the corners
};

// Camera, mirror poses and world frame from the tags that were seen:
//
//   1. a homography a frame by RANSAC;
//   2. K and the poses in closed form (Zhang 2000);
//   3. bundle adjustment of everything, each tag weighted by its own covariance, and again after outliers are marked;
//   4. each frame's pose tried with the opposite tilt, and judged: used only if it is certain and unambiguous.
//
// Throws InputError naming `source` when K cannot be found (no frame with tags, none of them tilted) or no frame is
// posed.
[[nodiscard]] CalibrationResult calibrate(const CalibrationInput&, const CalibrationOptions&, const Progress&);

}  // namespace mf
