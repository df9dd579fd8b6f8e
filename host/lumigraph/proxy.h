// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "host/io/mesh.h"
#include "host/lumigraph/posed_photo.h"
#include "host/tracing/ray_scene.h"

namespace mf {

// What the rays are taken to come from: the geometric proxy (Buehler et al. 2001, §3). World coordinates. Planes stay
// where they are when the new view moves, so that every goal that holds for a surface holds for them.

// normal · x = offset, the normal of unit length.
struct PlaneProxy {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
  float offset = 0;
};

// Surroundings: seen from inside, a ray meets the far wall.
struct SphereProxy {
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  float radius = 1;
};

// Surroundings too. A face at infinity is absent: a tunnel has no ends.
struct BoxProxy {
  Rigid3 box_from_world;
  Eigen::Vector3f low = Eigen::Vector3f::Constant(-1);
  Eigen::Vector3f high = Eigen::Vector3f::Constant(1);
};

struct MeshProxy {
  explicit MeshProxy(TriangleMesh m, std::optional<Eigen::Vector3f> inside_of_walls = {})
      : mesh(std::move(m)), scene(mesh), inside(std::move(inside_of_walls)) {}
  TriangleMesh mesh;
  RayScene scene;
  // Surroundings: a point that the mesh stands about. A ray meets the first triangle that it crosses away from this
  // point; a view beyond a wall looks through it, as with the sphere and the box.
  std::optional<Eigen::Vector3f> inside;
};

using Proxy = std::variant<PlaneProxy, SphereProxy, BoxProxy, MeshProxy>;

// A proxy as users name it, for a set of photos:
//   plane               faces the mean direction of sight, at the average 1/z of the scene: of the set's points, else
//   of
//                       the point where the optical axes converge
//   plane:D             the same at distance D (> 0) before the mean of the photos' centres
//   sphere:R            radius R about the mean of the centres
//   box                 the box of the set's points and the centres, axes of the world
//   box:x0,y0,z0,x1,y1,z1
//   tunnel:W,H[,D]      W wide and H high about the mean line of sight, closed at distance D or not at all
//   hull[:N[,x0,...]]   the visual hull of the photos' masks (visual_hull.h), N cells (128) along its longest side; the
//                       box that holds it is found, or given by its corners x0,y0,z0,x1,y1,z1
//   FILE                a mesh: OBJ, PLY, glTF; a relative path that is not in the working directory is looked for in
//                       `folder`, the photos'. When STEM_to_pose_similarity.npy lies beside the mesh, it is applied.
// Throws InputError naming what is wrong and what else to give.
[[nodiscard]] Proxy make_proxy(const std::string& name, const PhotoSet&, const std::filesystem::path& folder);

// The same as users would name it, with its numbers: for summaries.
[[nodiscard]] std::string describe(const Proxy&);

// STEM_to_pose_similarity.npy: ten doubles, a rotation vector r, a translation t, log s and a centre c, that take a
// mesh to the frame of the poses, v' = R(r)ᵀ (v − c − t) / s + c.
[[nodiscard]] TriangleMesh moved_by_similarity(TriangleMesh, const std::filesystem::path& npy);

// The photos' common place and direction of sight, unit length. Throws InputError when the photos look all around, so
// that they have none.
struct MeanSight {
  Eigen::Vector3d centre;
  Eigen::Vector3d direction;
};
[[nodiscard]] MeanSight mean_sight(const PhotoSet&);

}  // namespace mf
