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

// Can a ray from somewhere in a sphere along ω meet the box that holds the mesh? Slabs (Kay & Kajiya 1986), the box
// made larger by the sphere.
bool may_meet(const Bounds& bounds, const Eigen::Vector3f& centre, float radius, const Eigen::Vector3f& direction) {
  float enter = 0, leave = std::numeric_limits<float>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const float low = bounds.low[axis] - radius - centre[axis];
    const float high = bounds.high[axis] + radius - centre[axis];
    const float inverse = 1 / direction[axis];  // ±∞ for a ray along the slab: 0 · ∞ is NaN, which min and max pass by
    enter = std::max(enter, std::min(low * inverse, high * inverse));
    leave = std::min(leave, std::max(low * inverse, high * inverse));
  }
  return enter <= leave;
}

// From the lanes' points towards one light: unit directions, how far it is, and under which solid angle it is seen.
struct alignas(64) Rays {
  Lanes dx, dy, dz;
  Lanes length, solid_angle;
};

Rays towards(const DirectionalLight& light) {
  Rays rays;
  rays.dx.fill(light.direction.x()), rays.dy.fill(light.direction.y()), rays.dz.fill(light.direction.z());
  rays.length.fill(std::numeric_limits<float>::infinity());
  rays.solid_angle.fill(light.solid_angle_sr);
  return rays;
}

Rays towards(const EmitterPoint& light, const Packet& p) {
  constexpr float flattest = 1e-3F;  // rays that rise less do not cross the plane anywhere near
  Rays rays;
  for (std::size_t i = 0; i < lanes; ++i) {
    const Eigen::Vector3f x(p.x[i], p.y[i], p.z[i]);
    const Eigen::Vector3f to = light.position - x;
    rays.length[i] = to.norm();
    const Eigen::Vector3f d = to / std::max(rays.length[i], 1e-12F);
    rays.dx[i] = d.x(), rays.dy[i] = d.y(), rays.dz[i] = std::max(d.z(), flattest);
    rays.solid_angle[i] = d.z() > flattest ? light.solid_angle_from(x) : 0;
  }
  return rays;
}

// max(0, n·ω), zero too where the light is behind the triangle (when `one_sided`). Returns whether any lane is lit.
bool cosines(const Packet& p, const Rays& w, bool one_sided, Lanes& cosine) {
  float most = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float shading = p.nx[i] * w.dx[i] + p.ny[i] * w.dy[i] + p.nz[i] * w.dz[i];
    const float geometric = p.gx[i] * w.dx[i] + p.gy[i] * w.dy[i] + p.gz[i] * w.dz[i];
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
  bool mask(const Packet& packet, const Rays& rays, Lanes& cosine) {
    alignas(64) std::array<int, lanes> active{};
    RTCRay16 ray;
    for (std::size_t i = 0; i < lanes; ++i) {
      active[i] = cosine[i] > 0 ? -1 : 0;
      ray.org_x[i] = packet.ox[i], ray.org_y[i] = packet.oy[i], ray.org_z[i] = packet.oz[i];
      ray.dir_x[i] = rays.dx[i], ray.dir_y[i] = rays.dy[i], ray.dir_z[i] = rays.dz[i];
      ray.tnear[i] = 0, ray.tfar[i] = rays.length[i];
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

void add_light(const Packet& packet, const Rays& rays, const PlaneImage& image, const Lanes& cosine, Sums& sums) {
  for (std::size_t i = 0; i < lanes; ++i) {
    if (cosine[i] <= 0) continue;
    const float along = packet.z[i] / rays.dz[i];
    const Eigen::Vector2f p(packet.x[i] - rays.dx[i] * along, packet.y[i] - rays.dy[i] * along);
    sums[i] += (cosine[i] * rays.solid_angle[i]) * sample(image, p);
  }
}

// Points that go through the lights together.
struct Block {
  std::vector<Packet> packets;
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  float radius = 0;
};

Block make_block(std::span<const SurfacePoint> points, float offset) {
  Block block;
  for (std::size_t i = 0; i < points.size(); i += lanes)
    block.packets.push_back(make_packet(points.subspan(i, std::min(lanes, points.size() - i)), offset));
  for (const Packet& p : block.packets) block.centre += p.centre / static_cast<float>(block.packets.size());
  for (const Packet& p : block.packets)
    block.radius = std::max(block.radius, (p.centre - block.centre).norm() + p.radius);
  return block;
}

// The sums of one block's points over the lights of a set.
class BlockSum {
 public:
  BlockSum(const RayScene& scene, std::span<const SurfacePoint> points, const LightSet& set, LightSum sum)
      : scene_(scene),
        set_(set),
        block_(make_block(points, scene.surface_offset_m())),
        blocked_(sum == LightSum::blocked),
        tracer_(scene, sum) {
    Sums zero;
    zero.fill(Eigen::Vector4f::Zero());
    sums_.assign(block_.packets.size(), zero);
  }

  void run() {
    for (const DirectionalLight& light : set_.lights) {
      const Rays rays = towards(light);
      const bool near = may_meet(scene_.bounds(), block_.centre, block_.radius, light.direction);
      if (blocked_ && !near) continue;
      for (std::size_t k = 0; k < block_.packets.size(); ++k) {
        const Packet& packet = block_.packets[k];
        add(k, rays, light.image, near && may_meet(scene_.bounds(), packet.centre, packet.radius, light.direction));
      }
    }
    for (const EmitterPoint& light : set_.emitter_points)
      for (std::size_t k = 0; k < block_.packets.size(); ++k) {
        const Packet& packet = block_.packets[k];
        // Lines from a ball to one point stay within its radius of the line from its middle.
        const Eigen::Vector3f direction = (light.position - packet.centre).normalized();
        add(k, towards(light, packet), light.image, may_meet(scene_.bounds(), packet.centre, packet.radius, direction));
      }
  }
  void store(std::span<Eigen::Vector3f> result) const {
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = sums_[i / lanes][i % lanes].head<3>();
  }

 private:
  // `trace`: whether the mesh may be in the way.
  void add(std::size_t k, const Rays& rays, std::uint32_t image, bool trace) {
    alignas(64) Lanes cosine;
    if (blocked_ && !trace) return;
    if (!cosines(block_.packets[k], rays, !blocked_, cosine)) return;
    if (trace && !tracer_.mask(block_.packets[k], rays, cosine)) return;
    add_light(block_.packets[k], rays, set_.images[image], cosine, sums_[k]);
  }

  const RayScene& scene_;
  const LightSet& set_;
  Block block_;
  bool blocked_;
  Tracer tracer_;
  std::vector<Sums> sums_;
};

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
    BlockSum block_sum(scene, points.subspan(first, count), set, sum);
    block_sum.run();
    block_sum.store(std::span(result).subspan(first, count));
    const std::size_t finished = ++done;
    const std::lock_guard lock(reporting);
    report_progress(progress, "light (cpu)", static_cast<double>(finished) / static_cast<double>(blocks));
  });
  return result;
}

}  // namespace mf
