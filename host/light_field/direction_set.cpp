// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/direction_set.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "common/check.h"

namespace mf {

namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Polygon3 = std::vector<Eigen::Vector3d>;

struct Geodesic {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Triangle> triangles;  // counter-clockwise from outside
};

// Vertex at each pole, two rings of five between.
Geodesic icosahedron() {
  Geodesic ico;
  const double z = 1 / std::sqrt(5.0), r = 2 / std::sqrt(5.0);
  ico.vertices.emplace_back(0, 0, 1);
  for (int ring = 0; ring < 2; ++ring)
    for (int i = 0; i < 5; ++i) {
      const double a = (i + 0.5 * ring) * 2 * std::numbers::pi / 5;
      ico.vertices.emplace_back(r * std::cos(a), r * std::sin(a), ring == 0 ? z : -z);
    }
  ico.vertices.emplace_back(0, 0, -1);
  for (std::uint32_t i = 0; i < 5; ++i) {
    const std::uint32_t next = (i + 1) % 5;
    ico.triangles.push_back({0, 1 + i, 1 + next});
    ico.triangles.push_back({1 + i, 6 + i, 1 + next});
    ico.triangles.push_back({1 + next, 6 + i, 6 + next});
    ico.triangles.push_back({11, 6 + next, 6 + i});
  }
  return ico;
}

// Class I subdivision: every edge in f parts, new vertices pushed out to the sphere.
Geodesic subdivide(const Geodesic& ico, int f) {
  Geodesic sphere;
  std::map<std::tuple<int, int, int>, std::uint32_t> index_of;
  const auto vertex = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d n = p.normalized();
    constexpr double grid = 1e7;  // far below any edge, far above rounding: the same vertex from two faces meets here
    const auto key =
        std::make_tuple(static_cast<int>(std::lround(n.x() * grid)), static_cast<int>(std::lround(n.y() * grid)),
                        static_cast<int>(std::lround(n.z() * grid)));
    const auto [at, is_new] = index_of.try_emplace(key, static_cast<std::uint32_t>(sphere.vertices.size()));
    if (is_new) sphere.vertices.push_back(n);
    return at->second;
  };
  for (const Triangle& t : ico.triangles) {
    const Eigen::Vector3d &a = ico.vertices[t[0]], &b = ico.vertices[t[1]], &c = ico.vertices[t[2]];
    const auto at = [&](int i, int j) { return vertex(a * (f - i - j) + b * i + c * j); };
    for (int i = 0; i < f; ++i)
      for (int j = 0; i + j < f; ++j) {
        sphere.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
        if (i + j + 1 < f) sphere.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
  }
  return sphere;
}

// Voronoi cells: the circumcentres of the triangles about each vertex, in order.
std::vector<Polygon3> voronoi_cells(const Geodesic& sphere) {
  std::vector<Polygon3> cells(sphere.vertices.size());
  for (const Triangle& t : sphere.triangles) {
    const Eigen::Vector3d &a = sphere.vertices[t[0]], &b = sphere.vertices[t[1]], &c = sphere.vertices[t[2]];
    const Eigen::Vector3d centre = (b - a).cross(c - a).normalized();
    for (const std::uint32_t v : t) cells[v].push_back(centre);
  }
  for (std::size_t v = 0; v < cells.size(); ++v) {
    const Eigen::Vector3d x = sphere.vertices[v].unitOrthogonal(), y = sphere.vertices[v].cross(x);
    const auto angle = [&](const Eigen::Vector3d& p) { return std::atan2(p.dot(y), p.dot(x)); };
    std::sort(cells[v].begin(), cells[v].end(),
              [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) { return angle(p) < angle(q); });
  }
  return cells;
}

// What of a convex spherical polygon lies above the horizon (Sutherland–Hodgman; the horizon is a great circle).
Polygon3 clip_at_horizon(const Polygon3& polygon) {
  Polygon3 above;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    if (p.z() >= 0) above.push_back(p);
    if ((p.z() >= 0) != (q.z() >= 0)) above.push_back((p * q.z() - q * p.z()).normalized() * (q.z() > p.z() ? 1 : -1));
  }
  return above;
}

// Van Oosterom & Strackee 1983.
double triangle_solid_angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return 2 * std::atan2(std::abs(a.dot(b.cross(c))), 1 + a.dot(b) + b.dot(c) + c.dot(a));
}

double polygon_solid_angle(const Polygon3& polygon) {
  double sum = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    sum += triangle_solid_angle(polygon[0], polygon[i], polygon[i + 1]);
  return sum;
}

// Mean direction over the polygon (flat triangles: exact enough for cells of a few degrees, and only for rim cells).
Eigen::Vector3d polygon_centroid(const Polygon3& polygon) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    sum += triangle_solid_angle(polygon[0], polygon[i], polygon[i + 1]) * (polygon[0] + polygon[i] + polygon[i + 1]);
  return sum.normalized();
}

void split_triangle(const std::array<Eigen::Vector3d, 3>& t, int splits, std::vector<CellSample>& out) {
  if (splits == 0) {
    out.push_back(
        {(t[0] + t[1] + t[2]).normalized().cast<float>(), static_cast<float>(triangle_solid_angle(t[0], t[1], t[2]))});
    return;
  }
  std::size_t longest = 0;
  for (std::size_t e = 1; e < 3; ++e)
    if ((t[(e + 1) % 3] - t[e]).norm() > (t[(longest + 1) % 3] - t[longest]).norm()) longest = e;
  const Eigen::Vector3d &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3];
  const Eigen::Vector3d middle = (a + b).normalized();
  split_triangle({a, middle, c}, splits - 1, out);
  split_triangle({middle, b, c}, splits - 1, out);
}

}  // namespace

DirectionSet geodesic_hemisphere_of_frequency(int frequency) {
  check(frequency >= 1 && frequency <= 400, "a geodesic frequency between 1 and 400");
  const Geodesic sphere = subdivide(icosahedron(), frequency);
  const std::vector<Polygon3> cells = voronoi_cells(sphere);
  DirectionSet set;
  set.frequency = frequency;
  set.cell_begin.push_back(0);
  constexpr std::uint32_t dropped = 0xffffffff;
  std::vector<std::uint32_t> new_index(cells.size(), dropped);
  for (std::size_t v = 0; v < cells.size(); ++v) {
    const Polygon3 above = clip_at_horizon(cells[v]);
    const double solid_angle = polygon_solid_angle(above);
    if (solid_angle < 1e-12) continue;  // touches the horizon from below
    const bool cut = std::any_of(cells[v].begin(), cells[v].end(), [](const Eigen::Vector3d& p) { return p.z() < 0; });
    new_index[v] = static_cast<std::uint32_t>(set.directions.size());
    set.directions.push_back((cut ? polygon_centroid(above) : sphere.vertices[v]).cast<float>());
    set.solid_angles_sr.push_back(static_cast<float>(solid_angle));
    for (const Eigen::Vector3d& corner : above) set.cell_corners.push_back(corner.cast<float>());
    set.cell_begin.push_back(static_cast<std::uint32_t>(set.cell_corners.size()));
  }
  for (const Triangle& t : sphere.triangles)
    if (new_index[t[0]] != dropped && new_index[t[1]] != dropped && new_index[t[2]] != dropped)
      set.triangles.push_back({new_index[t[0]], new_index[t[1]], new_index[t[2]]});
  return set;
}

DirectionSet geodesic_hemisphere(int count) {
  check(count >= 1, "a direction set needs a direction");
  // A full sphere has 10 f² + 2 vertices. Half of them reach above the horizon, and of those that it cuts 2.5 f more if
  // f is even, 5 f if it is odd: begun with the even formula, one division less may do.
  int f = 1;
  while (5.0 * f * f + 2.5 * f + 1 < count) ++f;
  DirectionSet set = geodesic_hemisphere_of_frequency(std::max(1, f - 1));
  while (static_cast<double>(set.size()) < count) set = geodesic_hemisphere_of_frequency(set.frequency + 1);
  return set;
}

std::vector<CellSample> split_cell(const DirectionSet& set, std::size_t i, int splits) {
  std::vector<CellSample> parts;
  const std::span<const Eigen::Vector3f> corners = set.cell(i);
  const Eigen::Vector3d centre = set.directions[i].cast<double>();
  for (std::size_t c = 0; c < corners.size(); ++c)
    split_triangle({centre, corners[c].cast<double>(), corners[(c + 1) % corners.size()].cast<double>()}, splits,
                   parts);
  return parts;
}

std::vector<CellSample> split_cell(const DirectionSet& set, std::size_t i, int splits,
                                   const Eigen::Matrix3f& world_from_plane) {
  std::vector<CellSample> parts = split_cell(set, i, splits);
  for (CellSample& part : parts) part.direction = world_from_plane * part.direction;
  return parts;
}

}  // namespace mf
