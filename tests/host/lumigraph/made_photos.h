// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "host/io/view.h"
#include "host/lumigraph/posed_photo.h"
#include "host/lumigraph/proxy.h"

namespace mf::test {

// Linear colour of a place in the world, 0 to 1.
using Paint = std::function<Eigen::Vector3f(const Eigen::Vector3f& x_in_world)>;

// Blotches of three sizes, down to `finest` metres, a different mixture in each channel.
[[nodiscard]] Paint blotches(float finest);

[[nodiscard]] CameraModel pinhole(int size_px, double field_of_view_deg);
[[nodiscard]] Rigid3 looking(const Eigen::Vector3d& from, const Eigen::Vector3d& at);

// What a camera sees of painted, matt walls: the truth for any new view. Black where there is no wall. Linear;
// `samples`² rays a pixel.
[[nodiscard]] ImageF true_picture(const View&, const Proxy& walls, const Paint&, int samples = 1);
[[nodiscard]] PosedPhoto photo_of(const std::string& name, const View&, const Proxy& walls, const Paint&,
                                  int samples = 1);
[[nodiscard]] ImageU8 codes_of(const ImageF&);  // 0…1 → 0…255, no gamma

// `count` cameras on a spiral over a cap of `radius` about the origin, within `cap_deg` of +z, looking at the origin.
[[nodiscard]] std::vector<View> cap_of_views(int count, double radius, double cap_deg, const CameraModel&);

// A sphere of radius 1 with bumps, over a square floor: about 2 · steps² triangles.
[[nodiscard]] TriangleMesh bumpy_ball_on_floor(int steps);

}  // namespace mf::test
