// SPDX-License-Identifier: Apache-2.0
#include "tests/host/calibration/synthetic_views.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <numbers>

namespace mf::testing {

MirrorTarget framed_mirror() {
  MirrorTarget target;
  target.family = "tag36h11";
  target.opening_m = {0.34, 0.26};
  int id = 0;
  for (const double y : {0.155, -0.155})
    for (int i = 0; i < 10; ++i) target.tags.push_back({id++, 0.034, {-0.195 + 0.39 * i / 9, y}});
  for (const double x : {-0.195, 0.195})
    for (int i = 1; i < 7; ++i) target.tags.push_back({id++, 0.034, {x, -0.155 + 0.31 * i / 7}});
  return target;
}

CameraModel ordinary_camera() {
  CameraModel camera;
  camera.width = 768;
  camera.height = 640;
  camera.parameters = {1003.5, 1001.2, 391.4, 312.8, 0, 0, 0, 0, 0};
  return camera;
}

Rigid3 facing_pose(double distance_m, double tilt_rad, double axis_rad, const Eigen::Vector2d& offset_m) {
  // The mirror's x to the right, its y up (against the picture's), its z towards the camera: half a turn about x.
  const Eigen::Quaterniond facing(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond tilt(
      Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d(std::cos(axis_rad), std::sin(axis_rad), 0)));
  return {(tilt * facing).normalized(), {offset_m.x(), offset_m.y(), distance_m}};
}

namespace {

template <typename Corners>
void add_tag(TargetView& view, int id, const Corners& corners, const CameraModel& camera, const Rigid3& pose,
             double sigma_px, std::mt19937& random) {
  std::normal_distribution<double> noise(0, sigma_px);
  TagSighting tag{id, corners, {}, isotropic_information(sigma_px), true};
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d pixel = camera.project(pose * corners[k]);
    if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > camera.width || pixel.y() > camera.height) return;
    tag.corners_px[k] = pixel + Eigen::Vector2d(noise(random), noise(random));
  }
  view.tags.push_back(tag);
}

}  // namespace

TargetView seen(const CameraModel& camera, const MirrorTarget& target, const Rigid3& cam_from_mirror, double sigma_px,
                std::mt19937& random) {
  TargetView view;
  for (const PlanarTag& tag : target.tags) {
    std::array<Eigen::Vector3d, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) corners[k] << tag.corners_m()[k], 0;
    add_tag(view, tag.id, corners, camera, cam_from_mirror, sigma_px, random);
  }
  return view;
}

SyntheticCapture synthetic_capture(const CameraModel& camera, int frames, double sigma_px, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  SyntheticCapture capture;
  capture.camera = camera;
  capture.input.source = "synthetic";
  capture.input.width = camera.width;
  capture.input.height = camera.height;
  const MirrorTarget target = framed_mirror();
  for (int i = 0; i < frames; ++i) {
    const double tilt = (10 + 40 * unit(random)) * std::numbers::pi / 180;
    const Rigid3 pose = facing_pose(0.8 + 0.5 * unit(random), tilt, 2 * std::numbers::pi * unit(random),
                                    {0.2 * (unit(random) - 0.5), 0.2 * (unit(random) - 0.5)});
    capture.cam_from_mirror.push_back(pose);
    capture.input.mirror.push_back(seen(camera, target, pose, sigma_px, random));
    capture.input.mirror.back().name = fmt::format("{:03}.png", i);
  }
  capture.cam_from_world = facing_pose(1.3, 0.9, 0.1, {0.02, 0.05});
  capture.input.world.name = "world";
  int id = 100;
  for (const double x : {-0.28, 0.28})
    for (const double y : {-0.2, 0.22}) {
      const WorldTag tag{id++, 0.08, {x, y, 0.001}};
      add_tag(capture.input.world, tag.id, tag.corners_in_world(), camera, capture.cam_from_world, sigma_px, random);
    }
  return capture;
}

}  // namespace mf::testing
