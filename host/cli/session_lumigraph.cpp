// SPDX-License-Identifier: Apache-2.0
#include "host/cli/session_lumigraph.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/check.h"
#include "common/dense.h"
#include "common/error.h"
#include "common/session.h"
#include "host/cli/session_files.h"
#include "host/light_field/resample.h"
#include "host/lumigraph/session_photos.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

// By the smallest light field that there is: only what it is focused on is wanted.
Surroundings surroundings_of_session(const fs::path& folder, const Progress& progress) {
  const SessionReader session(folder);
  const Calibration calibration = calibration_of(session);
  ResampleOptions options;
  options.directions = 11;
  options.size = 2;
  const auto rectangle = covered_rectangle(calibration, session.header().target, options.height_m);
  if (!rectangle)
    throw InputError("--proxy", "auto",
                     "needs mirror views that look through the world's ground: give sphere:R, box or a mesh");
  const std::vector<FieldView> views = load_field_views(session, response_of(session), calibration, {}, progress);
  return resample(views, *rectangle, options, progress).field.surroundings;
}

Proxy walls_of(const Surroundings& surroundings, const std::string& name) {
  if (surroundings.is_plane())
    throw InputError("--proxy", name, "is focused on its own plane, not on surroundings: resample with --proxy auto");
  return MeshProxy(mesh_of(surroundings), surroundings.centre_in_world);
}

// Where the mirror was waved: the point nearest to the photos' middle lines of sight, which all pass it.
Eigen::Vector3f middle_of_sweep(const PhotoSet& set) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const PosedPhoto& photo : set.photos) {
    const auto ray = photo.camera.unproject({photo.camera.width / 2.0, photo.camera.height / 2.0});
    if (!ray) continue;
    const Eigen::Vector3d d = (photo.cam_from_world.rotation.conjugate() * *ray).normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    a += across;
    b += across * centre_of(photo);
  }
  const auto solution = solve_symmetric(a, b);
  if (!solution) throw InputError(set.source, "--proxy", "shows one direction only: give plane:D");
  return Eigen::Vector3d(*solution).cast<float>();
}

}  // namespace

PhotoSet read_session_photos(const fs::path& folder, double scale, bool scene, const Progress& progress) {
  SessionPhotoOptions options;
  options.scale = scale;
  options.scene = scene;
  if (const auto wrong = options.validate()) throw InputError("lumigraph", "", *wrong);
  const SessionReader session(folder);
  return photos_of_session(session, response_of(session), calibration_of(session), options, progress);
}

Proxy session_proxy(const std::string& name, const PhotoSet& set, const fs::path& folder, const Progress& progress) {
  if (name == "auto") return walls_of(surroundings_of_session(folder, progress), name);
  if (name.ends_with(".lf.exr")) return walls_of(read_light_field(name).surroundings, name);
  if (name.starts_with("hull"))
    throw InputError("--proxy", name,
                     "needs silhouettes, which a session's frames do not have: give auto, sphere:R, box or a mesh");
  Proxy proxy = make_proxy(name, set, folder);
  if (auto* mesh = std::get_if<MeshProxy>(&proxy)) return MeshProxy(std::move(mesh->mesh), middle_of_sweep(set));
  return proxy;
}

TriangleMesh mesh_of(const Surroundings& surroundings) {
  check(!surroundings.is_plane(), "walls are made of surroundings");
  constexpr int rows = 90;
  constexpr int columns = 360;
  constexpr float nearest_inverse = 1 / 50.0F;
  constexpr float pi = std::numbers::pi_v<float>;
  TriangleMesh mesh;
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const float polar = pi / 2 * static_cast<float>(row) / rows;
      const float azimuth = 2 * pi * static_cast<float>(column) / columns;
      const Eigen::Vector3f direction(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                                      std::cos(polar));
      const float inverse = std::max(surroundings.inverse_distance_of(direction), nearest_inverse);
      mesh.positions.push_back(surroundings.centre_in_world + direction / inverse);
      mesh.normals.push_back(direction);
      mesh.albedo.push_back(Eigen::Vector3f::Constant(default_albedo));
    }
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column) {
      const std::uint32_t a = row * columns + column;
      const std::uint32_t b = row * columns + (column + 1) % columns;
      if (row > 0) mesh.triangles.push_back({a, a + columns, b});
      mesh.triangles.push_back({b, a + columns, b + columns});
    }
  return mesh;
}

}  // namespace mf
