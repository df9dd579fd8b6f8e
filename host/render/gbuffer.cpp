// SPDX-License-Identifier: Apache-2.0
#include "host/render/gbuffer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace mf {

namespace {

constexpr int tile_px = 8;
constexpr std::size_t samples = 16;  // a pixel: 4×4

struct Sample {
  bool hit = false;
  std::uint32_t triangle = 0;
  float u = 0, v = 0;
  SurfacePoint point;
};
using PixelSamples = std::array<Sample, samples>;

Eigen::Vector3f blend(const std::vector<Eigen::Vector3f>& by_vertex, const std::array<std::uint32_t, 3>& t, float u,
                      float v) {
  return (1 - u - v) * by_vertex[t[0]] + u * by_vertex[t[1]] + v * by_vertex[t[2]];
}

// Both normals on the side that the camera sees: an open mesh is lit from either side.
SurfacePoint surface_point(const TriangleMesh& mesh, const Sample& s, const Eigen::Vector3f& ray) {
  const auto& t = mesh.triangles[s.triangle];
  const Eigen::Vector3f& a = mesh.positions[t[0]];
  SurfacePoint point;
  point.position = blend(mesh.positions, t, s.u, s.v);
  point.normal = blend(mesh.normals, t, s.u, s.v).normalized();
  point.geometric_normal = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).normalized();
  if (point.geometric_normal.dot(point.normal) < 0) point.geometric_normal *= -1;  // winding against the normals
  if (point.geometric_normal.dot(ray) > 0) {
    point.geometric_normal *= -1;
    point.normal *= -1;
  }
  return point;
}

class PixelCaster {
 public:
  PixelCaster(const TriangleMesh& mesh, const RayScene& scene, const CameraModel& camera, const Rigid3& cam_from_plane)
      : mesh_(&mesh),
        scene_(&scene),
        camera_(&camera),
        plane_from_cam_(cam_from_plane.inverse()),
        rotation_(plane_from_cam_.rotation.toRotationMatrix()),
        origin_(plane_from_cam_.translation.cast<float>()) {}

  [[nodiscard]] PixelSamples cast(int px, int py) const {
    PixelSamples result;
    alignas(64) std::array<int, samples> active{};
    RTCRayHit16 rays;
    std::array<Eigen::Vector3f, samples> directions;
    for (std::size_t i = 0; i < samples; ++i) {
      const std::size_t column = i % 4, row = i / 4;
      const double sx = (static_cast<double>(column) + 0.5) / 4;
      const double sy = (static_cast<double>(row) + 0.5) / 4;
      const auto ray = camera_->unproject({px + sx, py + sy});
      active[i] = ray ? -1 : 0;
      directions[i] = (rotation_ * ray.value_or(Eigen::Vector3d::UnitZ())).cast<float>();
      rays.ray.org_x[i] = origin_.x(), rays.ray.org_y[i] = origin_.y(), rays.ray.org_z[i] = origin_.z();
      rays.ray.dir_x[i] = directions[i].x(), rays.ray.dir_y[i] = directions[i].y(),
      rays.ray.dir_z[i] = directions[i].z();
      rays.ray.tnear[i] = 0, rays.ray.tfar[i] = std::numeric_limits<float>::infinity();
      rays.ray.time[i] = 0, rays.ray.mask[i] = ~0U, rays.ray.id[i] = 0, rays.ray.flags[i] = 0;
      rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context = coherent_context();
    rtcIntersect16(active.data(), scene_->handle(), &context, &rays);
    for (std::size_t i = 0; i < samples; ++i) {
      if (active[i] == 0 || rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      result[i] = {true, rays.hit.primID[i], rays.hit.u[i], rays.hit.v[i], {}};
      result[i].point = surface_point(*mesh_, result[i], directions[i]);
    }
    return result;
  }

  [[nodiscard]] std::optional<Eigen::Vector3d> ground(int px, int py) const {
    return ground_point(*camera_, plane_from_cam_, {px + 0.5, py + 0.5});
  }

  // Samples of one surface: alike in normal, and the step from one to the other runs along the surface.
  [[nodiscard]] static bool same_surface(const Sample& a, const Sample& b) {
    constexpr float least_cosine = 0.9F;  // 26°: a crease is two surfaces, a curve within a pixel is one
    constexpr float steepest = 0.25F;     // the chord of such a curve leaves the tangent by sin 13°
    const Eigen::Vector3f step = b.point.position - a.point.position;
    return a.point.normal.dot(b.point.normal) > least_cosine &&
           std::abs(a.point.normal.dot(step)) <= steepest * step.norm();
  }

 private:
  const TriangleMesh* mesh_;
  const RayScene* scene_;
  const CameraModel* camera_;
  Rigid3 plane_from_cam_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3f origin_;
};

struct TileResult {
  std::vector<SurfacePoint> points;
  std::vector<Fragment> fragments;
  std::vector<SurfacePoint> ground_points;
  std::vector<std::uint32_t> ground_pixels;
};

// The members of one surface → one fragment at the member nearest to their mean position.
void add_fragment(const std::vector<const Sample*>& members, std::uint32_t pixel, TileResult& out) {
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const Sample* s : members) mean += s->point.position / static_cast<float>(members.size());
  const Sample* chosen = *std::min_element(members.begin(), members.end(), [&](const Sample* a, const Sample* b) {
    return (a->point.position - mean).squaredNorm() < (b->point.position - mean).squaredNorm();
  });
  out.points.push_back(chosen->point);
  out.fragments.push_back({pixel,
                           static_cast<float>(members.size()) / samples,
                           chosen->triangle,
                           {1 - chosen->u - chosen->v, chosen->u, chosen->v}});
}

void add_pixel(const PixelCaster& caster, int x, int y, std::uint32_t pixel, TileResult& out) {
  PixelSamples all = caster.cast(x, y);
  const auto hits = std::count_if(all.begin(), all.end(), [](const Sample& s) { return s.hit; });
  std::vector<const Sample*> members;
  for (std::size_t i = 0; i < samples; ++i) {
    if (!all[i].hit) continue;
    members.clear();
    for (std::size_t k = i; k < samples; ++k)
      if (all[k].hit && PixelCaster::same_surface(all[i], all[k])) members.push_back(&all[k]);
    add_fragment(members, pixel, out);
    for (const Sample* s : members) all[static_cast<std::size_t>(s - all.data())].hit = false;
  }
  if (hits == static_cast<std::ptrdiff_t>(samples)) return;
  if (const auto p = caster.ground(x, y)) {
    out.ground_points.push_back({p->cast<float>(), Eigen::Vector3f::UnitZ(), Eigen::Vector3f::UnitZ()});
    out.ground_pixels.push_back(pixel);
  }
}

template <typename T>
void append(std::vector<T>& all, const std::vector<T>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

}  // namespace

std::optional<Eigen::Vector3d> ground_point(const CameraModel& camera, const Rigid3& plane_from_cam,
                                            const Eigen::Vector2d& pixel) {
  const auto ray = camera.unproject(pixel);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d direction = plane_from_cam.rotation * *ray;
  const Eigen::Vector3d& centre = plane_from_cam.translation;
  // At the horizon a pixel spans kilometres of plane: no surface that anybody receives a shadow on.
  if (!(std::abs(direction.z()) > 1e-4 * direction.norm())) return std::nullopt;
  const double distance = -centre.z() / direction.z();
  if (!(distance > 0)) return std::nullopt;
  Eigen::Vector3d p = centre + distance * direction;
  p.z() = 0;
  return p;
}

GBuffer make_gbuffer(const TriangleMesh& mesh, const RayScene& scene, const CameraModel& camera,
                     const Rigid3& cam_from_plane) {
  const PixelCaster caster(mesh, scene, camera, cam_from_plane);
  const int columns = (camera.width + tile_px - 1) / tile_px;
  const int rows = (camera.height + tile_px - 1) / tile_px;
  std::vector<TileResult> tiles(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) {
    const int x0 = static_cast<int>(i % static_cast<std::size_t>(columns)) * tile_px;
    const int y0 = static_cast<int>(i / static_cast<std::size_t>(columns)) * tile_px;
    for (int y = y0; y < std::min(y0 + tile_px, camera.height); ++y)
      for (int x = x0; x < std::min(x0 + tile_px, camera.width); ++x)
        add_pixel(caster, x, y, static_cast<std::uint32_t>(y * camera.width + x), tiles[i]);
  });
  GBuffer g;
  g.width = camera.width;
  g.height = camera.height;
  for (const TileResult& tile : tiles) {
    append(g.points, tile.points);
    append(g.fragments, tile.fragments);
    append(g.ground_points, tile.ground_points);
    append(g.ground_pixels, tile.ground_pixels);
  }
  return g;
}

}  // namespace mf
