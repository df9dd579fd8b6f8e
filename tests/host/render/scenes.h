// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "host/io/mesh.h"
#include "host/light_field/light_field.h"
#include "host/render/surface_point.h"

namespace mf::test {

inline const double pi = std::numbers::pi;

// Surroundings at infinity: radiance(ω) is the same at every place.
template <typename Radiance>
LightField distant_field(int directions, const Radiance& radiance) {
  LightField field;
  field.directions = geodesic_hemisphere(directions);
  field.plane.min_m = {-0.5, -0.5};
  field.plane.max_m = {0.5, 0.5};
  field.resolution = 4;
  for (const Eigen::Vector3f& d : field.directions.directions) {
    const Eigen::Vector3f rgb = radiance(d);
    field.rgbc.insert(field.rgbc.end(), field.texel_count(), Eigen::Vector4f(rgb.x(), rgb.y(), rgb.z(), 1));
  }
  return field;
}

inline LightField constant_field(int directions, float radiance) {
  return distant_field(directions,
                       [&](const Eigen::Vector3f&) -> Eigen::Vector3f { return Eigen::Vector3f::Constant(radiance); });
}

// A rectangle parallel to the plane, facing down, centred at (x, y).
inline TriangleMesh rectangle(float x, float y, float width, float depth, float height, float albedo = 0.5F) {
  TriangleMesh mesh;
  for (int i = 0; i < 4; ++i) {
    const float sx = i == 0 || i == 3 ? -0.5F : 0.5F;
    const float sy = i < 2 ? -0.5F : 0.5F;
    mesh.positions.emplace_back(x + sx * width, y + sy * depth, height);
  }
  mesh.normals.assign(4, -Eigen::Vector3f::UnitZ());
  mesh.albedo.assign(4, Eigen::Vector3f::Constant(albedo));
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}

// A sphere of latitudes and longitudes with true normals; `inward` turns them.
inline TriangleMesh sphere(const Eigen::Vector3f& centre, float radius, int rows, float albedo = 0.5F,
                           bool inward = false) {
  TriangleMesh mesh;
  const int columns = 2 * rows;
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) {
      const double theta = pi * r / rows, phi = 2 * pi * c / columns;
      const Eigen::Vector3f n =
          Eigen::Vector3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta))
              .cast<float>();
      mesh.positions.push_back(centre + radius * n);
      mesh.normals.push_back(inward ? Eigen::Vector3f(-n) : n);
    }
  mesh.albedo.assign(mesh.positions.size(), Eigen::Vector3f::Constant(albedo));
  const auto at = [&](int r, int c) { return static_cast<std::uint32_t>(r * (columns + 1) + c); };
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      if (r > 0) mesh.triangles.push_back({at(r, c), at(r + 1, c), at(r, c + 1)});
      if (r + 1 < rows) mesh.triangles.push_back({at(r, c + 1), at(r + 1, c), at(r + 1, c + 1)});
    }
  return mesh;
}

inline SurfacePoint facing(const Eigen::Vector3f& position, const Eigen::Vector3f& normal) {
  return {position, normal, normal};
}

// Form factor from a point to a centred parallel rectangle (width × depth at the distance `height`): Howell's catalogue
// B-3, four corners.
inline double rectangle_form_factor(double width, double depth, double height) {
  const double a = width / 2 / height, b = depth / 2 / height;
  const double ra = std::sqrt(1 + a * a), rb = std::sqrt(1 + b * b);
  return 4 / (2 * pi) * (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb));
}

}  // namespace mf::test
