// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/progress.h"
#include "host/render/light_set.h"
#include "host/render/surface_point.h"
#include "host/tracing/ray_scene.h"

namespace mf {

// Which lights a sum takes in: those that reach the point, or those that the mesh keeps from it.
enum class LightSum { visible, blocked };

// Irradiance at each point from parallel lights, red, green, blue:
//
//   E(x) = Σ_i image_i(p_i(x)) max(0, n·ω_i) ΔΩ_i V(x, ω_i)        (blocked: 1 − V)
//
// V is 0 where the ray from x along ω meets the mesh. With LightSum::visible a light behind the triangle itself
// (geometric normal) doesn't count, whatever the shading normal says. Points side by side should be neighbours in
// space: they share packets.
[[nodiscard]] std::vector<Eigen::Vector3f> irradiance_cpu(const RayScene&, std::span<const SurfacePoint>,
                                                          const LightSet&, LightSum, const Progress& = {});

}  // namespace mf
