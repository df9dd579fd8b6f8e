// SPDX-License-Identifier: Apache-2.0
#include "host/render/bounce.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>

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

}  // namespace

std::vector<SurfacePoint> vertex_points(const TriangleMesh& mesh) {
  std::vector<SurfacePoint> points;
  points.reserve(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    points.push_back({mesh.positions[i], mesh.normals[i], mesh.normals[i]});
  return points;
}

std::vector<Eigen::Vector3f> vertex_irradiance(const TriangleMesh& mesh, const RayScene& scene, const LightSet& set) {
  return irradiance_cpu(scene, vertex_points(mesh), set, LightSum::visible);
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
