// SPDX-License-Identifier: Apache-2.0
#include "host/render/importance.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <queue>

#include "common/check.h"
#include "common/luminance.h"

namespace mf {

namespace {

// ---- what each cell brings ----

// The panorama's light in a cell, seen from x (world).
double light_of_surroundings(const LightField& field, const Eigen::Vector3f& x, const Eigen::Matrix3f& world_from_plane,
                             std::size_t cell) {
  const Surroundings& s = field.surroundings;
  const Eigen::Vector3f parallax =
      s.inverse_distance_along(x, world_from_plane * field.directions.directions[cell]) * (x - s.centre_in_world);
  double sum = 0;
  for (const CellSample& part : split_cell(field.directions, cell, 0)) {
    const Eigen::Vector3f seen_from_centre = (world_from_plane * part.direction + parallax).normalized();
    const Eigen::Vector4f colour = s.panorama_at(seen_from_centre);
    if (colour.w() > 0) sum += static_cast<double>(part.solid_angle_sr * luminance_of(colour.head<3>()));
  }
  return std::max(0., sum);
}

// ---- groups ----

// Light, and a trace of it by solid angle, so that cells without any have a direction and are cut evenly.
std::vector<double> with_a_trace(const DirectionSet& set, std::span<const double> light) {
  const double total = std::accumulate(light.begin(), light.end(), 0.);
  const double trace = (total > 0 ? total : 1) * 1e-4 / (2 * std::numbers::pi);
  std::vector<double> result(light.begin(), light.end());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] += trace * static_cast<double>(set.solid_angles_sr[i]);
  return result;
}

struct Candidate {
  std::vector<std::uint32_t> cells;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  // the longest
  double cost = 0;                                 // 0: a single cell

  bool operator<(const Candidate& other) const { return cost < other.cost; }
};

Candidate make_candidate(const DirectionSet& set, const std::vector<double>& light, std::vector<std::uint32_t> cells) {
  Candidate c;
  c.cells = std::move(cells);
  if (c.cells.size() < 2) return c;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double solid_angle = 0, sum = 0;
  for (const std::uint32_t i : c.cells) {
    const double w = static_cast<double>(set.solid_angles_sr[i]);
    mean += w * set.directions[i].cast<double>();
    solid_angle += w;
    sum += light[i];
  }
  mean /= solid_angle;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const std::uint32_t i : c.cells) {
    const Eigen::Vector3d d = set.directions[i].cast<double>() - mean;
    spread += static_cast<double>(set.solid_angles_sr[i]) / solid_angle * d * d.transpose();
  }
  c.axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
  c.cost = sum * std::sqrt(spread.trace());
  return c;
}

// In two of about the same solid angle.
std::array<std::vector<std::uint32_t>, 2> cut(const DirectionSet& set, Candidate c) {
  const auto along = [&](std::uint32_t i) { return set.directions[i].cast<double>().dot(c.axis); };
  std::sort(c.cells.begin(), c.cells.end(), [&](auto a, auto b) { return along(a) < along(b); });
  const std::size_t middle = c.cells.size() / 2;
  const auto at = c.cells.begin() + static_cast<std::ptrdiff_t>(middle);
  return {std::vector<std::uint32_t>(c.cells.begin(), at), std::vector<std::uint32_t>(at, c.cells.end())};
}

CellGroup make_group(const DirectionSet& set, const std::vector<double>& light, std::vector<std::uint32_t> cells) {
  CellGroup group;
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  double solid_angle = 0;
  for (const std::uint32_t i : cells) {
    vector += light[i] * set.directions[i].cast<double>();
    group.light += light[i];
    solid_angle += static_cast<double>(set.solid_angles_sr[i]);
  }
  group.cells = std::move(cells);
  group.direction = vector.normalized().cast<float>();
  group.solid_angle_sr = static_cast<float>(solid_angle * vector.norm() / group.light);
  return group;
}

// ---- where they are looked up ----

// Makes the request hold the points in which lines through the box along ω cross the plane.
void take_in(const Bounds& box, const Eigen::Vector3f& direction, TileRequest& request) {
  constexpr float flattest = 1e-3F;  // a thousand box heights away: outside of any rectangle, and finite
  const Eigen::Vector2f slope = direction.head<2>() / std::max(direction.z(), flattest);
  for (const Eigen::Vector3f& x : corners_of(box)) {
    const Eigen::Vector2f p = x.head<2>() - slope * x.z();
    request.min_m = request.min_m.cwiseMin(p);
    request.max_m = request.max_m.cwiseMax(p);
  }
}

}  // namespace

std::vector<double> light_of_tiles(const DirectionSet& set, std::span<const PlaneImage> tiles) {
  check(tiles.size() == set.size(), "a tile for each direction");
  std::vector<double> light(set.size());
  tbb::parallel_for(std::size_t{0}, light.size(), [&](std::size_t i) {
    double sum = 0;
    for (const Eigen::Vector4f& texel : std::span(tiles[i].texels, tiles[i].texel_count()))
      sum += static_cast<double>(luminance_of(texel.head<3>()));
    light[i] =
        std::max(0., sum / static_cast<double>(tiles[i].texel_count())) * static_cast<double>(set.solid_angles_sr[i]);
  });
  return light;
}

std::vector<double> light_on(const LightField& field, const Bounds& object_in_plane) {
  check(!field.surroundings.panorama.empty(), "surroundings with a panorama");
  std::vector<double> light(field.directions.size());
  const Eigen::Vector3f x = (field.plane.world_from_plane * object_in_plane.centre.cast<double>()).cast<float>();
  const Eigen::Matrix3f world_from_plane = field.plane.world_from_plane.rotation.toRotationMatrix().cast<float>();
  tbb::parallel_for(std::size_t{0}, light.size(),
                    [&](std::size_t i) { light[i] = light_of_surroundings(field, x, world_from_plane, i); });
  return light;
}

std::vector<CellGroup> group_cells(const DirectionSet& set, std::span<const double> light, int count) {
  check(count >= 1 && light.size() == set.size(), "at least one group, and a light for each cell");
  const std::vector<double> traced = with_a_trace(set, light);
  std::vector<CellGroup> groups;
  if (static_cast<std::size_t>(count) >= set.size()) {
    for (std::uint32_t i = 0; i < set.size(); ++i) groups.push_back(make_group(set, traced, {i}));
    return groups;
  }
  std::vector<std::uint32_t> all(set.size());
  std::iota(all.begin(), all.end(), 0U);
  std::priority_queue<Candidate> candidates;
  candidates.push(make_candidate(set, traced, std::move(all)));
  while (candidates.size() < static_cast<std::size_t>(count)) {
    const Candidate widest = candidates.top();
    candidates.pop();
    for (std::vector<std::uint32_t>& half : cut(set, widest))
      candidates.push(make_candidate(set, traced, std::move(half)));
  }
  for (; !candidates.empty(); candidates.pop()) groups.push_back(make_group(set, traced, candidates.top().cells));
  return groups;
}

std::vector<TileRequest> tiles_for_object(const DirectionSet& set, std::span<const CellGroup> groups,
                                          const Bounds& object_in_plane) {
  std::vector<TileRequest> requests;
  constexpr float beyond = std::numeric_limits<float>::max();
  for (const CellGroup& group : groups) {
    TileRequest request{group.cells, Eigen::Vector2f::Constant(beyond), Eigen::Vector2f::Constant(-beyond)};
    take_in(object_in_plane, group.direction, request);
    if (group.cells.size() == 1)
      for (const Eigen::Vector3f& corner : set.cell(group.cells.front())) take_in(object_in_plane, corner, request);
    requests.push_back(std::move(request));
  }
  return requests;
}

std::vector<TileRequest> tiles_for_plane(std::span<const CellGroup> groups, const PlaneRectangle& rectangle) {
  std::vector<TileRequest> requests;
  for (const CellGroup& group : groups)
    requests.push_back({group.cells, rectangle.min_m.cast<float>(), rectangle.max_m.cast<float>()});
  return requests;
}

}  // namespace mf
