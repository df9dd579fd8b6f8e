// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "common/json_file.h"
#include "host/io/image_file.h"
#include "host/io/view.h"
#include "host/lumigraph/posed_photo.h"

namespace mf::test {

// A painted wall, the plane y = 3 of the world, and cameras before it that look along +y.
inline constexpr double wall_distance_m = 3;

// 8-bit codes at the wall's point (x, z): smooth, and different at every place that a photo shows.
inline Eigen::Vector3d wall_codes(double x, double z) {
  return {128 + 110 * std::sin(2 * x), 128 + 110 * std::sin(2 * z + 1), 128 + 110 * std::sin(1.3 * x + 1.6 * z)};
}

inline View view_from(double x) {
  Eigen::Matrix3d axes;  // camera x is world x, camera y is down, camera z is world y
  axes << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  View view;
  view.camera.width = 160;
  view.camera.height = 120;
  view.camera.parameters = {150, 150, 80, 60, 0, 0, 0, 0, 0};
  view.cam_from_world = Rigid3{Eigen::Quaterniond(axes), {x, 0, 0}}.inverse();
  return view;
}

// What a camera sees of the wall, at a pixel position.
inline Eigen::Vector3d wall_seen(const View& view, const Eigen::Vector2d& pixel) {
  const Rigid3 world_from_cam = view.cam_from_world.inverse();
  const Eigen::Vector3d ray = world_from_cam.rotation * *view.camera.unproject(pixel);
  const Eigen::Vector3d centre = world_from_cam.translation;
  const Eigen::Vector3d point = centre + (wall_distance_m - centre.y()) / ray.y() * ray;
  return wall_codes(point.x(), point.z());
}

inline ImageU8 wall_picture(const View& view) {
  ImageU8 picture(view.camera.width, view.camera.height, 3);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const Eigen::Vector3d codes = wall_seen(view, {x + 0.5, y + 0.5});
      for (int c = 0; c < 3; ++c) picture.at(x, y, c) = static_cast<std::uint8_t>(std::lround(codes[c]));
    }
  return picture;
}

inline constexpr int wall_photo_count = 5;

// Photo i was taken at x = (i − 2) · 0.3 m.
inline double wall_photo_x(int i) {
  return 0.3 * (i - 2);
}

inline PhotoSet wall_photos() {
  PhotoSet set;
  set.source = "wall";
  for (int i = 0; i < wall_photo_count; ++i) {
    const View view = view_from(wall_photo_x(i));
    set.photos.push_back(
        {"wall" + std::to_string(i) + ".png", view.camera, view.cam_from_world, wall_picture(view), {}, std::nullopt});
  }
  return set;
}

// The same as files: transforms.json and PNGs.
inline void write_wall_photos(const std::filesystem::path& folder) {
  const PhotoSet set = wall_photos();
  const CameraModel& camera = set.photos.front().camera;
  nlohmann::json all{{"fl_x", camera.fx()}, {"fl_y", camera.fy()}, {"cx", camera.cx()},
                     {"cy", camera.cy()},   {"w", camera.width},   {"h", camera.height}};
  for (const PosedPhoto& photo : set.photos) {
    write_png(folder / photo.name, std::get<ImageU8>(photo.picture));
    Eigen::Matrix4d world_from_camera = photo.cam_from_world.inverse().matrix();
    world_from_camera.middleCols<2>(1) *= -1;  // x right, y up, looking along −z
    nlohmann::json rows = nlohmann::json::array();
    for (int r = 0; r < 4; ++r)
      rows.push_back(
          {world_from_camera(r, 0), world_from_camera(r, 1), world_from_camera(r, 2), world_from_camera(r, 3)});
    all["frames"].push_back({{"file_path", photo.name}, {"transform_matrix", rows}});
  }
  write_json_file(folder / "transforms.json", all);
}

}  // namespace mf::test
