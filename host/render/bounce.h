// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "host/render/irradiance.h"

namespace mf {

// Irradiance on each vertex of a mesh (the vertex normal stands for the geometric one).
[[nodiscard]] std::vector<Eigen::Vector3f> vertex_irradiance(const TriangleMesh&, const RayScene&, const LightSet&);

// What the lit object sends to other places, one diffuse bounce: at each point
//
//   E(x) = Σ_k (albedo E_v / π)(y_k) max(0, n·ω_k) ΔΩ,   y_k: where the ray from x along ω_k meets the mesh,
//
// over `directions` directions spread evenly over the sphere, E_v interpolated between the vertices. The light varies
// slowly, so a few hundred directions do. `points` may lie on the mesh itself.
[[nodiscard]] std::vector<Eigen::Vector3f> gather_bounce(const TriangleMesh&, const RayScene&,
                                                         std::span<const Eigen::Vector3f> irradiance_on_vertices,
                                                         std::span<const SurfacePoint> points, int directions);

// The vertices as points to gather light at.
[[nodiscard]] std::vector<SurfacePoint> vertex_points(const TriangleMesh&);

}  // namespace mf
