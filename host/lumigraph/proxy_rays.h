// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "host/lumigraph/proxy.h"

namespace mf {

// Rays from one point, by coordinate, and where they meet a proxy first.
struct ProxyRays {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  std::span<const float> dx, dy, dz;  // any length
  std::span<float> distance;          // in lengths of the direction; infinite: the ray misses
  std::span<float> nx, ny, nz;        // the proxy's normal there, unit length, either side; a mesh's is interpolated
};

// Neighbours in the spans should be neighbours in the picture: mesh rays are traced in packets.
void trace(const Proxy&, const ProxyRays&);

}  // namespace mf
