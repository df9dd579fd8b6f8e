// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

#include "host/render/irradiance.h"

namespace mf {

namespace {

constexpr std::size_t lanes = 16;  // rtcOccluded16
// Points that run through all lights together: their sums stay in the first-level cache while a tile streams by.
constexpr std::size_t packets_per_block = 64;
using Lanes = std::array<float, lanes>;

// Sixteen points side by side, ready to be traced, and the sphere that holds them.
struct alignas(64) Packet {
  Lanes x, y, z;     // position
  Lanes nx, ny, nz;  // shading normal; zero in lanes that stand for no point
  Lanes gx, gy, gz;  // geometric normal
  Lanes ox, oy, oz;  // where shadow rays start
  Eigen::Vector3f centre;
  float radius = 0;
};

Packet make_packet(std::span<const SurfacePoint> points, float offset) {
  Packet packet;
  packet.centre = Eigen::Vector3f::Zero();
  for (const SurfacePoint& p : points) packet.centre += p.position / static_cast<float>(points.size());
  for (std::size_t i = 0; i < lanes; ++i) {
    const SurfacePoint& p = points[std::min(i, points.size() - 1)];
    const Eigen::Vector3f n = i < points.size() ? p.normal : Eigen::Vector3f(Eigen::Vector3f::Zero());
    const Eigen::Vector3f origin = p.position + offset * p.geometric_normal;
    packet.x[i] = p.position.x(), packet.y[i] = p.position.y(), packet.z[i] = p.position.z();
    packet.nx[i] = n.x(), packet.ny[i] = n.y(), packet.nz[i] = n.z();
    packet.gx[i] = p.geometric_normal.x(), packet.gy[i] = p.geometric_normal.y(), packet.gz[i] = p.geometric_normal.z();
    packet.ox[i] = origin.x(), packet.oy[i] = origin.y(), packet.oz[i] = origin.z();
    packet.radius = std::max(packet.radius, (p.position - packet.centre).norm());
  }
  return packet;
}

// Can a ray from the packet along ω meet the sphere that holds the mesh?
bool may_meet(const BoundingSphere& bounds, const Packet& packet, const Eigen::Vector3f& direction) {
  const Eigen::Vector3f to_centre = bounds.centre - packet.centre;
  const float reach = bounds.radius + packet.radius;
  const float along = to_centre.dot(direction);
  return along > -reach && to_centre.squaredNorm() - along * along < reach * reach;
}

// max(0, n·ω), zero too where the light is behind the triangle (when `one_sided`). Returns whether any lane is lit.
bool cosines(const Packet& p, const Eigen::Vector3f& w, bool one_sided, Lanes& cosine) {
  float most = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float shading = p.nx[i] * w.x() + p.ny[i] * w.y() + p.nz[i] * w.z();
    const float geometric = p.gx[i] * w.x() + p.gy[i] * w.y() + p.gz[i] * w.z();
    const bool lit = !one_sided || geometric > 0;
    cosine[i] = lit ? std::max(shading, 0.F) : 0.F;
    most = std::max(most, cosine[i]);
  }
  return most > 0;
}

class Tracer {
 public:
  Tracer(const RayScene& scene, LightSum sum) : scene_(&scene), sum_(sum), context_(coherent_context()) {}

  // Zeroes the cosine of every lane that the sum leaves out. Returns whether any is left.
  bool mask(const Packet& packet, const Eigen::Vector3f& direction, Lanes& cosine) {
    if (!may_meet(scene_->bounds(), packet, direction)) return sum_ == LightSum::visible;
    alignas(64) std::array<int, lanes> active{};
    RTCRay16 ray;
    for (std::size_t i = 0; i < lanes; ++i) {
      active[i] = cosine[i] > 0 ? -1 : 0;
      ray.org_x[i] = packet.ox[i], ray.org_y[i] = packet.oy[i], ray.org_z[i] = packet.oz[i];
      ray.dir_x[i] = direction.x(), ray.dir_y[i] = direction.y(), ray.dir_z[i] = direction.z();
      ray.tnear[i] = 0, ray.tfar[i] = std::numeric_limits<float>::infinity();
      ray.time[i] = 0, ray.mask[i] = ~0U, ray.id[i] = 0, ray.flags[i] = 0;
    }
    rtcOccluded16(active.data(), scene_->handle(), &context_, &ray);
    bool any = false;
    for (std::size_t i = 0; i < lanes; ++i) {
      const bool occluded = ray.tfar[i] < 0;  // Embree: −∞ where something is in the way
      if (occluded != (sum_ == LightSum::blocked)) cosine[i] = 0;
      any = any || cosine[i] > 0;
    }
    return any;
  }

 private:
  const RayScene* scene_;
  LightSum sum_;
  RTCIntersectContext context_;
};

using Sums = std::array<Eigen::Vector4f, lanes>;

void add_light(const Packet& packet, const DirectionalLight& light, const PlaneImage& image, const Lanes& cosine,
               Sums& sums) {
  const float sx = light.direction.x() / light.direction.z();
  const float sy = light.direction.y() / light.direction.z();
  for (std::size_t i = 0; i < lanes; ++i) {
    if (cosine[i] <= 0) continue;
    const Eigen::Vector2f p(packet.x[i] - sx * packet.z[i], packet.y[i] - sy * packet.z[i]);
    sums[i] += (cosine[i] * light.solid_angle_sr) * sample(image, p);
  }
}

void sum_block(const RayScene& scene, std::span<const SurfacePoint> points, const LightSet& set, LightSum sum,
               Eigen::Vector3f* result) {
  std::vector<Packet> packets;
  for (std::size_t i = 0; i < points.size(); i += lanes)
    packets.push_back(make_packet(points.subspan(i, std::min(lanes, points.size() - i)), scene.surface_offset_m()));
  Sums zero;
  zero.fill(Eigen::Vector4f::Zero());
  std::vector<Sums> sums(packets.size(), zero);
  Tracer tracer(scene, sum);
  alignas(64) Lanes cosine;
  for (const DirectionalLight& light : set.lights)
    for (std::size_t k = 0; k < packets.size(); ++k) {
      if (!cosines(packets[k], light.direction, sum == LightSum::visible, cosine)) continue;
      if (!tracer.mask(packets[k], light.direction, cosine)) continue;
      add_light(packets[k], light, set.images[light.image], cosine, sums[k]);
    }
  for (std::size_t i = 0; i < points.size(); ++i) result[i] = sums[i / lanes][i % lanes].head<3>();
}

}  // namespace

std::vector<Eigen::Vector3f> irradiance_cpu(const RayScene& scene, std::span<const SurfacePoint> points,
                                            const LightSet& set, LightSum sum, const Progress& progress) {
  std::vector<Eigen::Vector3f> result(points.size());
  constexpr std::size_t block = packets_per_block * lanes;
  const std::size_t blocks = (points.size() + block - 1) / block;
  std::atomic<std::size_t> done = 0;
  std::mutex reporting;
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) {
    const std::size_t first = b * block;
    const std::size_t count = std::min(block, points.size() - first);
    sum_block(scene, points.subspan(first, count), set, sum, result.data() + first);
    const std::size_t finished = ++done;
    const std::lock_guard lock(reporting);
    report_progress(progress, "light (cpu)", static_cast<double>(finished) / static_cast<double>(blocks));
  });
  return result;
}

}  // namespace mf
