// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/camera_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/check.h"
#include "common/error.h"
#include "common/json_file.h"

namespace mf {

namespace {

constexpr int most_frames = 100000;  // about an hour: more is a slip in the file

// Between p1 (t = 0) and p2 (t = 1), with the neighbours' chords as tangents (Catmull, Rom 1974).
template <typename V>
V catmull_rom(const V& p0, const V& p1, const V& p2, const V& p3, double t) {
  return p1 + 0.5 * t * ((p2 - p0) + t * ((2 * p0 - 5 * p1 + 4 * p2 - p3) + t * (3 * (p1 - p2) + p3 - p0)));
}

struct Knot {
  Eigen::Vector3d centre;
  Eigen::Vector4d rotation;  // quaternion world_from_cam, on the same half as its predecessor
};

std::vector<Knot> knots_of(const std::vector<View>& keys) {
  std::vector<Knot> knots;
  for (const View& key : keys) {
    const Rigid3 world_from_cam = key.cam_from_world.inverse();
    Eigen::Vector4d rotation = world_from_cam.rotation.coeffs();
    if (!knots.empty() && rotation.dot(knots.back().rotation) < 0) rotation = -rotation;
    knots.push_back({world_from_cam.translation, rotation});
  }
  return knots;
}

}  // namespace

std::vector<View> interpolated(const std::vector<View>& keys, int frames) {
  check(keys.size() >= 2 && frames >= 2, "a path leads from one key frame to another");
  const std::vector<Knot> knots = knots_of(keys);
  const auto last = static_cast<int>(keys.size()) - 1;
  const auto knot = [&](int i) -> const Knot& { return knots[static_cast<std::size_t>(std::clamp(i, 0, last))]; };
  std::vector<View> views;
  for (int frame = 0; frame < frames; ++frame) {
    const double at = static_cast<double>(frame) * last / (frames - 1);
    const int i = std::min(static_cast<int>(at), last - 1);
    const double t = at - i;
    View view = keys[static_cast<std::size_t>(i)];
    const auto& next = keys[static_cast<std::size_t>(i) + 1].camera.parameters;
    for (std::size_t p = 0; p < next.size(); ++p)
      view.camera.parameters[p] += t * (next[p] - view.camera.parameters[p]);
    const Eigen::Vector4d q = catmull_rom<Eigen::Vector4d>(knot(i - 1).rotation, knot(i).rotation, knot(i + 1).rotation,
                                                           knot(i + 2).rotation, t);
    const Rigid3 world_from_cam{
        Eigen::Quaterniond(q).normalized(),
        catmull_rom<Eigen::Vector3d>(knot(i - 1).centre, knot(i).centre, knot(i + 1).centre, knot(i + 2).centre, t)};
    view.cam_from_world = world_from_cam.inverse();
    views.push_back(view);
  }
  return views;
}

std::vector<View> read_camera_path(const std::filesystem::path& path) {
  const std::string file = path.string();
  const nlohmann::json json = read_json_file(path);
  const bool keyed = json.is_object();
  if (keyed && !json.contains("views")) throw InputError(file, "views", "is missing: list the key frames");
  const nlohmann::json& list = keyed ? json.at("views") : json;
  if (!list.is_array() || list.empty())
    throw InputError(file, keyed ? "views" : "", "is no list of views: see docs/lumigraph.md");
  std::vector<View> views;
  for (std::size_t i = 0; i < list.size(); ++i)
    views.push_back(view_from_json(list[i], fmt::format("{}[{}].", keyed ? "views" : "", i), file));
  if (!keyed) return views;
  const int frames = json_field<int>(json, "frames", file);
  if (frames < 2 || frames > most_frames)
    throw InputError(file, "frames", fmt::format("must be between 2 and {}", most_frames));
  if (views.size() < 2) throw InputError(file, "views", "has one key frame only: give two or more, or a plain list");
  for (std::size_t i = 1; i < views.size(); ++i)
    if (views[i].camera.width != views[0].camera.width || views[i].camera.height != views[0].camera.height)
      throw InputError(file, fmt::format("views[{}].size", i), "differs from the first key frame's: give one size");
  return interpolated(views, frames);
}

}  // namespace mf
