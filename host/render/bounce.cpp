// SPDX-License-Identifier: Apache-2.0
#include "host/render/bounce.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/check.h"

namespace mf {

namespace {

std::vector<Eigen::Vector3f> even_directions(int count) {
  constexpr double golden_angle = 2.399963229728653;  // π (3 − √5)
  std::vector<Eigen::Vector3f> directions;
  for (int k = 0; k < count; ++k) {
    const double z = 1 - (2 * k + 1.) / count;
    const double r = std::sqrt(1 - z * z);
    directions.push_back(
        Eigen::Vector3d(r * std::cos(k * golden_angle), r * std::sin(k * golden_angle), z).cast<float>());
  }
  return directions;
}

// Ten bits an axis, interleaved: neighbours in this order are neighbours in space (Morton 1966), as packets like it.
std::uint32_t morton_code(const Eigen::Vector3f& p, const Bounds& bounds) {
  const Eigen::Vector3f fraction = (p - bounds.centre) / (2 * std::max(bounds.radius, 1e-12F));  // no size: one place
  std::uint32_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::uint32_t>(std::clamp((fraction[axis] + 0.5F) * 1024, 0.F, 1023.F));
    for (int bit = 0; bit < 10; ++bit) code |= ((cell >> bit) & 1U) << (3 * bit + axis);
  }
  return code;
}

}  // namespace

std::vector<SurfacePoint> vertex_points(const TriangleMesh& mesh) {
  std::vector<SurfacePoint> points;
  points.reserve(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    points.push_back({mesh.positions[i], mesh.normals[i], mesh.normals[i]});
  return points;
}

std::vector<Eigen::Vector3f> vertex_irradiance(const TriangleMesh& mesh, const RayScene& scene, const LightSet& set) {
  std::vector<std::uint32_t> order(mesh.positions.size());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<std::uint32_t> code;
  code.reserve(mesh.positions.size());
  for (const Eigen::Vector3f& p : mesh.positions) code.push_back(morton_code(p, scene.bounds()));
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return code[a] < code[b]; });
  const std::vector<SurfacePoint> points = vertex_points(mesh);
  std::vector<SurfacePoint> sorted;
  sorted.reserve(order.size());
  for (const std::uint32_t i : order) sorted.push_back(points[i]);
  const std::vector<Eigen::Vector3f> by_order = irradiance_cpu(scene, sorted, set, LightSum::visible);
  std::vector<Eigen::Vector3f> result(by_order.size());
  for (std::size_t k = 0; k < order.size(); ++k) result[order[k]] = by_order[k];
  return result;
}

std::vector<Eigen::Vector3f> gather_bounce(const TriangleMesh& mesh, const RayScene& scene,
                                           std::span<const Eigen::Vector3f> irradiance_on_vertices,
                                           std::span<const SurfacePoint> points, int directions) {
  check(irradiance_on_vertices.size() == mesh.positions.size(), "an irradiance for every vertex");
  const std::vector<Eigen::Vector3f> sphere = even_directions(directions);
  const float solid_angle = 4 * std::numbers::pi_v<float> / static_cast<float>(directions);
  const auto sent = [&](std::uint32_t v) -> Eigen::Vector3f {
    return mesh.albedo[v].cwiseProduct(irradiance_on_vertices[v]) / std::numbers::pi_v<float>;
  };
  std::vector<Eigen::Vector3f> result(points.size(), Eigen::Vector3f::Zero());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    const SurfacePoint& p = points[i];
    const Eigen::Vector3f origin = p.position + scene.surface_offset_m() * p.geometric_normal;
    for (const Eigen::Vector3f& d : sphere) {
      const float cosine = p.normal.dot(d);
      if (cosine <= 0) continue;
      const auto hit = scene.intersect(origin, d);
      if (!hit) continue;
      const auto& t = mesh.triangles[hit->triangle];
      result[i] +=
          (cosine * solid_angle) * ((1 - hit->u - hit->v) * sent(t[0]) + hit->u * sent(t[1]) + hit->v * sent(t[2]));
    }
  });
  return result;
}

}  // namespace mf
