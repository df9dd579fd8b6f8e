// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <embree3/rtcore.h>

#include <cstdint>

#include "host/io/mesh.h"

namespace mf {

// A mesh in Embree's acceleration structure. Safe to share among threads.
class RayScene {
 public:
  // An empty mesh is a scene that no ray hits.
  explicit RayScene(const TriangleMesh&);
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;
  RayScene(RayScene&&) noexcept;
  ~RayScene();

  [[nodiscard]] RTCScene handle() const { return scene_; }
  [[nodiscard]] const Bounds& bounds() const { return bounds_; }

  // How far a shadow ray must start off its surface, metres: well above the rounding of single-precision coordinates at
  // the scene's size, well below any detail that a picture shows.
  [[nodiscard]] float surface_offset_m() const { return surface_offset_m_; }

  // The nearest triangle along a ray from `origin` to infinity.
  struct Hit {
    std::uint32_t triangle = 0;
    float distance = 0;  // in lengths of `direction`
    float u = 0, v = 0;  // barycentric weights of the triangle's second and third vertex
  };
  [[nodiscard]] std::optional<Hit> intersect(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;

 private:
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  Bounds bounds_;
  float surface_offset_m_ = 0;
};

// Coherent: packets whose rays run side by side, as camera and shadow rays do.
[[nodiscard]] RTCIntersectContext coherent_context();

}  // namespace mf
