// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <random>
#include <vector>

#include "host/light_field/field_views.h"

namespace mf::testing {

// Views of an analytic light: pinholes 0.5 to 1 m below the plane z = 0 that look up at all slants, as the virtual
// cameras behind a hand-held mirror do. `radiance(origin, direction)` says what a ray sees.
using Light = std::function<Eigen::Vector3f(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction)>;

inline FieldView analytic_view(const Eigen::Vector3f& centre, const Eigen::Vector3f& look_at, int size_px,
                               const Light& light) {
  const Eigen::Vector3f z = (look_at - centre).normalized();
  const Eigen::Vector3f x = z.unitOrthogonal(), y = z.cross(x);
  Eigen::Matrix3f view_from_world;
  view_from_world << x.transpose(), y.transpose(), z.transpose();
  const float focal = 1.2F * static_cast<float>(size_px), middle = 0.5F * static_cast<float>(size_px);
  Eigen::Matrix3f k;
  k << focal, 0, middle, 0, focal, middle, 0, 0, 1;
  FieldView view;
  view.pixel_from_world << k * view_from_world, -(k * view_from_world * centre);
  view.centre_in_world = centre;
  view.focal_px = focal;
  std::vector<Eigen::Vector4f> texels;
  for (int v = 0; v < size_px; ++v)
    for (int u = 0; u < size_px; ++u) {
      constexpr int n = 4;  // a pixel integrates: n × n rays
      Eigen::Vector3f colour = Eigen::Vector3f::Zero();
      for (int i = 0; i < n * n; ++i) {
        const int column = i % n, row = i / n;
        const float du = (static_cast<float>(column) + 0.5F) / n, dv = (static_cast<float>(row) + 0.5F) / n;
        const Eigen::Vector3f ray((static_cast<float>(u) + du - middle) / focal,
                                  (static_cast<float>(v) + dv - middle) / focal, 1);
        colour += light(centre, (view_from_world.transpose() * ray).normalized()) / (n * n);
      }
      const float edge =
          static_cast<float>(std::min({u, v, size_px - 1 - u, size_px - 1 - v})) / (0.1F * static_cast<float>(size_px));
      const float a = std::min(1.0F, edge);
      texels.emplace_back(colour.x() * a, colour.y() * a, colour.z() * a, a);
    }
  view.levels = make_levels(size_px, size_px, texels);
  return view;
}

// `count` views; each looks through a random point of the plane's square ± reach towards a random upward direction.
inline std::vector<FieldView> analytic_views(int count, float reach, int size_px, const Light& light) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<FieldView> views;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3f through((2 * uniform(random) - 1) * reach, (2 * uniform(random) - 1) * reach, 0);
    const float z = 0.15F + 0.85F * uniform(random), angle = 6.2831853F * uniform(random), r = std::sqrt(1 - z * z);
    const Eigen::Vector3f direction(r * std::cos(angle), r * std::sin(angle), z);
    views.push_back(analytic_view(through - 0.8F * direction, through, size_px, light));
  }
  return views;
}

}  // namespace mf::testing
