// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace mf {

// A square tag in a plane. A tag is read with x to its right and y up; its corners lie at ± size/2 from the centre.
struct PlanarTag {
  int id = 0;
  double size_m = 0;         // edge of the black square
  Eigen::Vector2d centre_m;  // in the plane's frame

  // Lower left, lower right, upper right, upper left: the order of TagDetection::corners_px.
  [[nodiscard]] std::array<Eigen::Vector2d, 4> corners_m() const;
};

// The mirror with its frame of tags. Mirror frame: origin at the opening's centre, x right, y up, z = 0 the reflecting
// surface and +z the reflecting side, metres. `target.json`: family, tag_size_m, opening_m [w, h], tags [{id,
// centre_m}].
struct MirrorTarget {
  std::string family;         // AprilTag family, e.g. tag36h11
  Eigen::Vector2d opening_m;  // width and height of the mirror that the tags leave free, centred at the origin
  std::vector<PlanarTag> tags;

  [[nodiscard]] const PlanarTag* find(int id) const;  // nullptr: no such tag
};

// The scene's own tags: they define the world frame, Z up, metres. Tags lie flat (x right is world +x, y up world +y).
// `world.json`: family, tags [{id, size_m, centre_in_world_m [x, y, z]}], and an optional checkerboard.
struct WorldTag {
  int id = 0;
  double size_m = 0;
  Eigen::Vector3d centre_in_world;

  [[nodiscard]] std::array<Eigen::Vector3d, 4> corners_in_world() const;  // order as PlanarTag
};
struct Checkerboard {
  std::array<int, 2> squares{};
  Eigen::Vector3d centre_in_world;
  Eigen::Vector2d size_m;
};
struct WorldTarget {
  std::string family;
  std::vector<WorldTag> tags;
  std::optional<Checkerboard> checkerboard;

  [[nodiscard]] const WorldTag* find(int id) const;
};

// Both throw InputError naming `file` and the field: unknown family, repeated id, a size that is not positive, tags
// that overlap each other or the opening, fewer than one tag.
[[nodiscard]] MirrorTarget mirror_target_from_json(const nlohmann::json&, const std::string& file);
[[nodiscard]] WorldTarget world_target_from_json(const nlohmann::json&, const std::string& file);

// The AprilTag families that TagDetector knows.
[[nodiscard]] bool is_known_tag_family(const std::string& family);

}  // namespace mf
