// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/desk_rig.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mf::sim {

namespace {

Rigid3 look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& at) {
  Eigen::Matrix3d world_from_cam;
  const Eigen::Vector3d forward = (at - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  world_from_cam << right, forward.cross(right), forward;  // x right, y down, z forward
  return Rigid3{Eigen::Quaterniond(world_from_cam), eye}.inverse();
}

}  // namespace

std::uint64_t stream_key(std::uint64_t seed, Stream stream, int index) {
  return mix(mix(seed, static_cast<std::uint64_t>(stream)), static_cast<std::uint64_t>(index));
}

CameraModel desk_camera(int size) {
  const double focal_px = 1055.0 / 768 * size;
  return {size, size, {focal_px, focal_px, 0.5 * size, 0.5 * size, 0, 0, 0, 0, 0}};
}

Rigid3 desk_cam_from_world(int view) {
  constexpr std::array<std::array<double, 3>, 3> eyes{{{0.05, -0.85, 0.75}, {-0.62, -0.55, 0.62}, {0.6, -0.6, 0.66}}};
  const auto& eye = eyes.at(static_cast<std::size_t>(view));
  return look_at({eye[0], eye[1], eye[2]}, {0, 0.05, 0.03});
}

Region whole(const CameraModel& camera) {
  return {0, 0, camera.width, camera.height};
}

Region around_plate(const CameraModel& camera, const Rigid3& cam_from_mirror, const Eigen::Vector2d& half_size) {
  constexpr double spare_px = 8;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9);
  Eigen::Vector2d high = -low;
  for (const double x : {-half_size.x(), half_size.x()})
    for (const double y : {-half_size.y(), half_size.y()}) {
      const Eigen::Vector2d p = camera.project(cam_from_mirror * Eigen::Vector3d(x, y, 0));
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  const auto even = [](double v, int limit) { return std::clamp(static_cast<int>(std::floor(v / 2)) * 2, 0, limit); };
  return {even(low.x() - spare_px, camera.width), even(low.y() - spare_px, camera.height),
          even(high.x() + spare_px, camera.width), even(high.y() + spare_px, camera.height)};
}

DeskRig::DeskRig(int size, std::uint64_t seed, std::shared_ptr<const EnvironmentMap> panorama)
    : scene(desk_scene(stream_key(seed, Stream::scene))), camera(desk_camera(size)) {
  scene.panorama = std::move(panorama);
  motion = {cam_from_world.inverse().translation, scene.lamp.centre_in_world.cast<double>(), plate.half_size_m()};
}

}  // namespace mf::sim
