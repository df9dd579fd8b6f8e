// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "common/session.h"
#include "host/calibration/calibration.h"
#include "host/light_field/light_field.h"

namespace mf::test {

inline constexpr double mirror_height_m = 0.3;

// A camera 1 m above the world's origin that looks straight down (camera x is world x, y is −y), and mirrors of
// 0.2 × 0.1 m that lie at `mirror_height_m`, facing up, at the given places.
inline Calibration looking_down(const std::vector<Eigen::Vector2d>& places) {
  Calibration calibration;
  calibration.camera.width = calibration.camera.height = 1000;
  calibration.camera.parameters = {1000, 1000, 500, 500, 0, 0, 0, 0, 0};
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(3.14159265358979, Eigen::Vector3d::UnitX()));
  calibration.cam_from_world = Rigid3{turned, {0, 0, 1}};
  for (const Eigen::Vector2d& place : places) {
    MirrorPose pose;
    pose.used = true;
    pose.cam_from_mirror =
        *calibration.cam_from_world * Rigid3{Eigen::Quaterniond::Identity(), {place.x(), place.y(), mirror_height_m}};
    calibration.frames.push_back(pose);
  }
  return calibration;
}

inline MirrorTarget small_mirror() {
  MirrorTarget target;
  target.family = "tag36h11";
  target.opening_m = {0.2, 0.1};
  target.tags.push_back({0, 0.03, {0.13, 0}});
  return target;
}

inline PlaneRectangle table() {
  return {{}, {-0.3, -0.3}, {0.3, 0.3}};
}

// A calibrated session of them, without its pictures.
inline void write_session(const std::filesystem::path& folder, const Calibration& calibration) {
  SessionHeader header;
  header.width = calibration.camera.width;
  header.height = calibration.camera.height;
  header.target = small_mirror();
  SessionWriter writer(folder, header, {});
  writer.finish();
  write_calibration(folder / "calibration.json", calibration);
}

}  // namespace mf::test
