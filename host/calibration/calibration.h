// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/rigid3.h"

namespace mf {

// Where the mirror was in one frame.
struct MirrorPose {
  std::string name;        // the frame's name in the session
  Rigid3 cam_from_mirror;  // identity when not used
  double rms_px = 0;       // reprojection error of its inlier corners
  int inlier_corners = 0;
  int outlier_corners = 0;
  bool used = false;              // posed, and trusted
  std::string why_not;            // in a few words, when not used
  double rotation_sigma_rad = 0;  // from the covariance: one standard deviation, all axes together
  double position_sigma_m = 0;
};

// The record that later stages read: calibration.json.
struct Calibration {
  CameraModel camera;
  CameraModel::Parameters camera_sigma{};  // one standard deviation, parameter by parameter
  std::optional<Rigid3> cam_from_world;    // nothing when the session has no world tags
  double world_rms_px = 0;
  double world_rotation_sigma_rad = 0;
  double world_position_sigma_m = 0;
  double rms_px = 0;                           // over all inlier corners of used frames
  std::vector<MirrorPose> frames;              // every mirror frame of the session, in its order
  std::map<std::string, std::string> options;  // what it was made with, for the record
};

// Both throw InputError naming file and field.
[[nodiscard]] Calibration read_calibration(const std::filesystem::path&);
void write_calibration(const std::filesystem::path&, const Calibration&);

}  // namespace mf
