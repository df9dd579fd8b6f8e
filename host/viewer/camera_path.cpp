// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/camera_path.h"

#include <array>
#include <nlohmann/json.hpp>

#include "common/check.h"
#include "common/json_file.h"

namespace mf {

namespace {

// What is interpolated of a view: its centre, its orientation as a quaternion's coefficients, fx and fy as a share of
// the picture's width, cx and cy likewise.
using Knot = Eigen::Matrix<double, 11, 1>;

Knot knot_of(const View& view) {
  const Rigid3 world_from_cam = view.cam_from_world.inverse();
  Knot knot;
  knot << world_from_cam.translation, world_from_cam.rotation.coeffs(),
      Eigen::Map<const Eigen::Vector4d>(view.camera.parameters.data()) / view.camera.width;
  return knot;
}

View view_of(const Knot& knot, const CameraModel& lens) {
  View view{lens, {}};
  Eigen::Map<Eigen::Vector4d>(view.camera.parameters.data()) = knot.tail<4>() * lens.width;
  const Eigen::Quaterniond rotation(knot.segment<4>(3));
  view.cam_from_world = Rigid3{rotation.normalized(), knot.head<3>()}.inverse();
  return view;
}

// Between b (t = 0) and c (t = 1), with the slopes that the neighbours give.
Knot catmull_rom(const Knot& a, const Knot& b, const Knot& c, const Knot& d, double t) {
  return b + 0.5 * t * ((c - a) + t * ((2 * a - 5 * b + 4 * c - d) + t * (3 * (b - c) + d - a)));
}

}  // namespace

std::vector<View> smooth_path(std::span<const View> keys, int steps) {
  check(steps >= 1, "a path has a view for every key");
  if (keys.size() < 2) return {keys.begin(), keys.end()};
  std::vector<Knot> knots;
  for (const View& key : keys) {
    knots.push_back(knot_of(key));
    // A quaternion and its negative are one rotation: take the one nearer to the key before.
    if (knots.size() > 1 && knots.back().segment<4>(3).dot(knots[knots.size() - 2].segment<4>(3)) < 0)
      knots.back().segment<4>(3) *= -1;
  }
  const auto knot = [&](std::size_t i, int offset) -> const Knot& {
    const auto at = static_cast<std::ptrdiff_t>(i) + offset;
    return knots[static_cast<std::size_t>(std::clamp(at, std::ptrdiff_t{0}, std::ssize(knots) - 1))];
  };
  std::vector<View> path;
  for (std::size_t i = 0; i + 1 < keys.size(); ++i)
    for (int s = 0; s < steps; ++s)
      path.push_back(
          view_of(catmull_rom(knot(i, -1), knot(i, 0), knot(i, 1), knot(i, 2), static_cast<double>(s) / steps),
                  keys.front().camera));
  path.push_back(view_of(knots.back(), keys.front().camera));
  return path;
}

void write_views(const std::filesystem::path& file, std::span<const View> views) {
  nlohmann::json list = nlohmann::json::array();
  for (const View& view : views) {
    const CameraModel& c = view.camera;
    const std::array<double, 5> distortion{c.parameters[4], c.parameters[5], c.parameters[6], c.parameters[7],
                                           c.parameters[8]};
    list.push_back({{"camera_from_world", rigid3_to_json(view.cam_from_world)},
                    {"K", {{c.fx(), 0, c.cx()}, {0, c.fy(), c.cy()}, {0, 0, 1}}},
                    {"distortion", distortion},
                    {"size", {c.width, c.height}}});
  }
  write_json_file(file, list);
}

}  // namespace mf
