// SPDX-License-Identifier: Apache-2.0
#include "common/mirror_target.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/json_file.h"

namespace mf {

namespace {

constexpr std::array<const char*, 6> known_families{"tag36h11",      "tag25h9",          "tag16h5",
                                                    "tagCircle21h7", "tagStandard41h12", "tagStandard52h13"};

std::string family_from_json(const nlohmann::json& json, const std::string& file) {
  std::string family = json_field<std::string>(json, "family", file);
  if (!is_known_tag_family(family))
    throw InputError(file, "family",
                     fmt::format("'{}' is no tag family known here: use tag36h11, tag25h9, tag16h5, "
                                 "tagCircle21h7, tagStandard41h12 or tagStandard52h13",
                                 family));
  return family;
}

template <int N>
Eigen::Matrix<double, N, 1> vector_from_json(const nlohmann::json& json, const std::string& key,
                                             const std::string& file) {
  const auto values = json_field<std::vector<double>>(json, key, file);
  if (values.size() != N || !std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); }))
    throw InputError(file, key, fmt::format("needs {} finite numbers", N));
  return Eigen::Map<const Eigen::Matrix<double, N, 1>>(values.data());
}

double positive_from_json(const nlohmann::json& json, const std::string& key, const std::string& file) {
  const double value = json_field<double>(json, key, file);
  if (!(value > 0) || !std::isfinite(value)) throw InputError(file, key, "must be a positive number of metres");
  return value;
}

bool squares_overlap(const Eigen::Vector2d& a, double size_a, const Eigen::Vector2d& b, double size_b) {
  const double reach = 0.5 * (size_a + size_b) * (1 - 1e-9);  // touching edges are no overlap
  return std::abs(a.x() - b.x()) < reach && std::abs(a.y() - b.y()) < reach;
}

void require_disjoint(const MirrorTarget& target, const std::string& file) {
  for (std::size_t i = 0; i < target.tags.size(); ++i) {
    const PlanarTag& tag = target.tags[i];
    const Eigen::Vector2d reach = 0.5 * (target.opening_m.array() + tag.size_m).matrix() * (1 - 1e-9);
    if (std::abs(tag.centre_m.x()) < reach.x() && std::abs(tag.centre_m.y()) < reach.y())
      throw InputError(
          file, fmt::format("tags[{}]", i),
          fmt::format("tag {} overlaps the mirror's opening: check centre_m, tag_size_m and opening_m", tag.id));
    for (std::size_t j = 0; j < i; ++j) {
      const PlanarTag& other = target.tags[j];
      if (other.id == tag.id)
        throw InputError(file, fmt::format("tags[{}].id", i),
                         fmt::format("tag {} is listed twice: give every tag its own id", tag.id));
      if (squares_overlap(tag.centre_m, tag.size_m, other.centre_m, other.size_m))
        throw InputError(file, fmt::format("tags[{}]", i),
                         fmt::format("tags {} and {} overlap: check centre_m and tag_size_m", other.id, tag.id));
    }
  }
}

void require_disjoint(const WorldTarget& world, const std::string& file) {
  constexpr double same_height_m = 0.01;  // tags on a shelf above others overlap in x and y, and may
  for (std::size_t i = 0; i < world.tags.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const WorldTag& tag = world.tags[i];
      const WorldTag& other = world.tags[j];
      if (std::abs(tag.centre_in_world.z() - other.centre_in_world.z()) < same_height_m &&
          squares_overlap(tag.centre_in_world.head<2>(), tag.size_m, other.centre_in_world.head<2>(), other.size_m))
        throw InputError(file, fmt::format("tags[{}]", i),
                         fmt::format("tags {} and {} overlap: check centre_in_world_m and size_m", other.id, tag.id));
    }
}

}  // namespace

bool is_known_tag_family(const std::string& family) {
  return std::any_of(known_families.begin(), known_families.end(), [&](const char* known) { return family == known; });
}

std::array<Eigen::Vector2d, 4> PlanarTag::corners_m() const {
  const double h = 0.5 * size_m;
  return {centre_m + Eigen::Vector2d(-h, -h), centre_m + Eigen::Vector2d(h, -h), centre_m + Eigen::Vector2d(h, h),
          centre_m + Eigen::Vector2d(-h, h)};
}

std::array<Eigen::Vector3d, 4> WorldTag::corners_in_world() const {
  const double h = 0.5 * size_m;
  return {centre_in_world + Eigen::Vector3d(-h, -h, 0), centre_in_world + Eigen::Vector3d(h, -h, 0),
          centre_in_world + Eigen::Vector3d(h, h, 0), centre_in_world + Eigen::Vector3d(-h, h, 0)};
}

const PlanarTag* MirrorTarget::find(int id) const {
  const auto found = std::find_if(tags.begin(), tags.end(), [&](const PlanarTag& t) { return t.id == id; });
  return found == tags.end() ? nullptr : &*found;
}

const WorldTag* WorldTarget::find(int id) const {
  const auto found = std::find_if(tags.begin(), tags.end(), [&](const WorldTag& t) { return t.id == id; });
  return found == tags.end() ? nullptr : &*found;
}

MirrorTarget mirror_target_from_json(const nlohmann::json& json, const std::string& file) {
  MirrorTarget target;
  target.family = family_from_json(json, file);
  const double size = positive_from_json(json, "tag_size_m", file);
  target.opening_m = vector_from_json<2>(json, "opening_m", file);
  if (!(target.opening_m.minCoeff() > 0)) throw InputError(file, "opening_m", "must be two positive lengths in metres");
  for (const nlohmann::json& tag : json_field<std::vector<nlohmann::json>>(json, "tags", file))
    target.tags.push_back({json_field<int>(tag, "id", file), size, vector_from_json<2>(tag, "centre_m", file)});
  if (target.tags.empty()) throw InputError(file, "tags", "is empty: list the tags of the mirror's frame");
  require_disjoint(target, file);
  return target;
}

WorldTarget world_target_from_json(const nlohmann::json& json, const std::string& file) {
  WorldTarget world;
  world.family = family_from_json(json, file);
  for (const nlohmann::json& tag : json_field<std::vector<nlohmann::json>>(json, "tags", file)) {
    const int id = json_field<int>(tag, "id", file);
    if (world.find(id) != nullptr)
      throw InputError(file, "tags", fmt::format("tag {} is listed twice: give every tag its own id", id));
    world.tags.push_back(
        {id, positive_from_json(tag, "size_m", file), vector_from_json<3>(tag, "centre_in_world_m", file)});
  }
  if (world.tags.empty()) throw InputError(file, "tags", "is empty: list the tags that define the world frame");
  require_disjoint(world, file);
  if (json.contains("checkerboard")) {
    const nlohmann::json& board = json.at("checkerboard");
    const Eigen::Vector2d squares = vector_from_json<2>(board, "squares", file);
    world.checkerboard = Checkerboard{{static_cast<int>(squares.x()), static_cast<int>(squares.y())},
                                      vector_from_json<3>(board, "centre_in_world_m", file),
                                      vector_from_json<2>(board, "size_m", file)};
  }
  return world;
}

}  // namespace mf
