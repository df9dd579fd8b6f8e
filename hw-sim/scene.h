// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "common/mirror_target.h"
#include "hw-sim/environment_map.h"
#include "hw-sim/printed_tags.h"

namespace mf::sim {

using Rgb = Eigen::Array3f;  // linear BT.709: radiance, or a reflectance in [0, 1]

// What every print of the scene is made of: the table's tags and the mirror's frame.
inline const Rgb paper{0.75F, 0.75F, 0.72F};
inline const Rgb ink{0.04F, 0.04F, 0.04F};

// Triangles in the world frame, metres. Both sides are seen.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Lambertian reflectances, as functions of the world point.
struct PlainPaint {
  Rgb albedo;
};
// Stripes along z: a wall that a view can be focused on.
struct StripedPaint {
  Rgb albedo;
  float period_m;
  float contrast;  // 0 (plain) to 1
};
// The table: wood, a checkerboard and the world tags, all at z = 0.
struct TablePaint {
  Rgb wood;
  Checkerboard board;
  PrintedTags tags;
};
using Paint = std::variant<PlainPaint, StripedPaint, TablePaint>;
[[nodiscard]] Rgb albedo_at(const Paint&, const Eigen::Vector3f& x_in_world);

struct Surface {
  Mesh mesh;
  Paint paint;
};

// The one strong light: a globe of constant radiance.
struct Lamp {
  Eigen::Vector3f centre_in_world;
  float radius_m;
  Rgb radiance;
};

// Distant light, by direction (unit length, pointing at the surroundings): a hall with a gradient and soft windows.
[[nodiscard]] Rgb surroundings(const Eigen::Vector3f& direction_in_world);

struct Scene {
  WorldTarget world;
  std::vector<Surface> surfaces;
  Lamp lamp;
  std::shared_ptr<const EnvironmentMap>
      panorama;  // what is distant; null: surroundings(). Scenes are copied, it is not
};

// A desk: table with checkerboard and four tags about the world origin, a lamp one metre away behind leaves, two walls.
// `seed` turns and moves the leaves a little.
[[nodiscard]] Scene desk_scene(std::uint64_t seed);

// The mirror of the desk: 0.34 × 0.26 m of glass in a frame of 22 tags of 48 mm.
[[nodiscard]] MirrorTarget desk_mirror();

// A trefoil knot, a closed tube of about 0.16 m that floats over the world origin, its lowest point at `clearance_m`.
[[nodiscard]] Mesh trefoil_knot(double clearance_m);

}  // namespace mf::sim
