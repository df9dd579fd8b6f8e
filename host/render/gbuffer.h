// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/io/view.h"
#include "host/render/surface_point.h"
#include "host/tracing/ray_scene.h"

namespace mf {

// A piece of surface that a pixel sees.
struct Fragment {
  std::uint32_t pixel = 0;  // y · width + x
  float coverage = 0;       // part of the pixel, 0 to 1
  std::uint32_t triangle = 0;
  std::array<float, 3> barycentric{};  // weights of the triangle's vertices
};

// What a camera sees, to be lit: made once by ray casting (Embree), read by both back ends.
//
// A pixel takes 4×4 samples. Samples that hit the same smooth surface are one fragment, lit once at the sample nearest
// to their middle: inside a surface that is one a pixel, at an outline two or three, so that antialiasing costs little.
// `points[i]` belongs to `fragments[i]`; both run through the picture in 8×8 blocks, so that neighbours in the list are
// neighbours in space. Where a pixel isn't covered by the object and its ray meets the plane z = 0, `ground_points` has
// a point too (normal up), and `ground_pixels` its pixel.
struct GBuffer {
  int width = 0;
  int height = 0;
  std::vector<SurfacePoint> points;
  std::vector<Fragment> fragments;
  std::vector<SurfacePoint> ground_points;
  std::vector<std::uint32_t> ground_pixels;
};

// `mesh` and `scene` are the same surface, in the plane frame.
[[nodiscard]] GBuffer make_gbuffer(const TriangleMesh& mesh, const RayScene& scene, const CameraModel& camera,
                                   const Rigid3& cam_from_plane);

// Where the ray through a pixel position meets z = 0, in the plane frame; nothing if it doesn't, ahead of the camera.
[[nodiscard]] std::optional<Eigen::Vector3d> ground_point(const CameraModel&, const Rigid3& plane_from_cam,
                                                          const Eigen::Vector2d& pixel);

}  // namespace mf
