// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/proxy_rays.h"

#include <embree3/rtcore.h>

#include <cmath>
#include <limits>

namespace mf {

namespace {

constexpr float no_hit = std::numeric_limits<float>::infinity();

void trace_surface(const PlaneProxy& plane, const ProxyRays& rays) {
  const float height = plane.offset - plane.normal.dot(rays.origin);
  for (std::size_t i = 0; i < rays.dx.size(); ++i) {
    const float along = plane.normal.x() * rays.dx[i] + plane.normal.y() * rays.dy[i] + plane.normal.z() * rays.dz[i];
    const float distance = height / along;
    rays.distance[i] = distance > 0 ? distance : no_hit;
    rays.nx[i] = plane.normal.x();
    rays.ny[i] = plane.normal.y();
    rays.nz[i] = plane.normal.z();
  }
}

// The far root of |o + t d − c|² = r²; from outside the near wall is looked through, as walls of a doll's house are.
void trace_surface(const SphereProxy& sphere, const ProxyRays& rays) {
  const Eigen::Vector3f o = rays.origin - sphere.centre;
  const float c = o.squaredNorm() - sphere.radius * sphere.radius;
  for (std::size_t i = 0; i < rays.dx.size(); ++i) {
    const Eigen::Vector3f d(rays.dx[i], rays.dy[i], rays.dz[i]);
    const float a = d.squaredNorm();
    const float b = o.dot(d);
    const float discriminant = b * b - a * c;
    const float distance = discriminant >= 0 ? (-b + std::sqrt(discriminant)) / a : -1;
    rays.distance[i] = distance > 0 ? distance : no_hit;
    const Eigen::Vector3f n =
        distance > 0 ? Eigen::Vector3f((o + distance * d) / sphere.radius) : Eigen::Vector3f::UnitZ();
    rays.nx[i] = n.x();
    rays.ny[i] = n.y();
    rays.nz[i] = n.z();
  }
}

// Where the ray leaves the slabs that it is in last: the far wall.
void trace_surface(const BoxProxy& box, const ProxyRays& rays) {
  const Eigen::Matrix3f rotation = box.box_from_world.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f o = (box.box_from_world * rays.origin.cast<double>().eval()).cast<float>();
  for (std::size_t i = 0; i < rays.dx.size(); ++i) {
    const Eigen::Vector3f d = rotation * Eigen::Vector3f(rays.dx[i], rays.dy[i], rays.dz[i]);
    float enter = 0;
    float leave = no_hit;
    int wall = 2;
    for (int axis = 0; axis < 3; ++axis) {
      if (d[axis] == 0) continue;
      const float a = (box.low[axis] - o[axis]) / d[axis];
      const float b = (box.high[axis] - o[axis]) / d[axis];
      enter = std::max(enter, std::min(a, b));
      if (std::max(a, b) < leave) {
        leave = std::max(a, b);
        wall = axis;
      }
    }
    rays.distance[i] = leave > enter ? leave : no_hit;
    rays.nx[i] = rotation(wall, 0);
    rays.ny[i] = rotation(wall, 1);
    rays.nz[i] = rotation(wall, 2);
  }
}

constexpr std::size_t packet = 16;  // rays that Embree traces side by side

Eigen::Vector3f shading_normal(const TriangleMesh& mesh, std::uint32_t triangle, float u, float v) {
  const auto& corners = mesh.triangles[triangle];
  return ((1 - u - v) * mesh.normals[corners[0]] + u * mesh.normals[corners[1]] + v * mesh.normals[corners[2]])
      .normalized();
}

// Towards the inside: such a crossing is looked through.
bool enters(const Eigen::Vector3f& inside, const Eigen::Vector3f& origin, const RTCRayHit16& hit, std::size_t i) {
  const Eigen::Vector3f d(hit.ray.dir_x[i], hit.ray.dir_y[i], hit.ray.dir_z[i]);
  const Eigen::Vector3f n(hit.hit.Ng_x[i], hit.hit.Ng_y[i], hit.hit.Ng_z[i]);
  return n.dot(d) * n.dot(origin + hit.ray.tfar[i] * d - inside) < 0;
}

// Traces once more the rays whose crossing is looked through, from just beyond it.
void cross_entrances(const MeshProxy& proxy, const Eigen::Vector3f& origin, int* valid, RTCRayHit16& hit) {
  constexpr int most_walls = 8;         // beyond that many a view lies outside of everything that it should show
  constexpr float just_beyond = 1e-4F;  // of the distance: above its rounding
  RTCIntersectContext context = coherent_context();
  for (int wall = 0; wall < most_walls; ++wall) {
    bool any = false;
    for (std::size_t i = 0; i < packet; ++i) {
      if (valid[i] == 0) continue;
      const bool met = hit.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      valid[i] = met && enters(*proxy.inside, origin, hit, i) ? -1 : 0;
      if (valid[i] == 0) continue;
      any = true;
      hit.ray.tnear[i] = hit.ray.tfar[i] * (1 + just_beyond);
      hit.ray.tfar[i] = no_hit;
      hit.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    if (!any) return;
    rtcIntersect16(valid, proxy.scene.handle(), &context, &hit);
  }
}

void trace_packet(const MeshProxy& proxy, const ProxyRays& rays, std::size_t first) {
  const std::size_t count = std::min(packet, rays.dx.size() - first);
  RTCIntersectContext context = coherent_context();
  alignas(64) RTCRayHit16 hit;
  alignas(64) int valid[packet];
  for (std::size_t i = 0; i < packet; ++i) {
    valid[i] = i < count ? -1 : 0;
    const std::size_t at = first + std::min(i, count - 1);
    hit.ray.org_x[i] = rays.origin.x();
    hit.ray.org_y[i] = rays.origin.y();
    hit.ray.org_z[i] = rays.origin.z();
    hit.ray.dir_x[i] = rays.dx[at];
    hit.ray.dir_y[i] = rays.dy[at];
    hit.ray.dir_z[i] = rays.dz[at];
    hit.ray.tnear[i] = 0;
    hit.ray.tfar[i] = no_hit;
    hit.ray.time[i] = 0;
    hit.ray.mask[i] = ~0U;
    hit.ray.flags[i] = 0;
    hit.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
  rtcIntersect16(valid, proxy.scene.handle(), &context, &hit);
  if (proxy.inside) cross_entrances(proxy, rays.origin, valid, hit);
  for (std::size_t i = 0; i < count; ++i) {
    const bool met = hit.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    const Eigen::Vector3f n =
        met ? shading_normal(proxy.mesh, hit.hit.primID[i], hit.hit.u[i], hit.hit.v[i]) : Eigen::Vector3f::UnitZ();
    rays.distance[first + i] = met ? hit.ray.tfar[i] : no_hit;
    rays.nx[first + i] = n.x();
    rays.ny[first + i] = n.y();
    rays.nz[first + i] = n.z();
  }
}

void trace_surface(const MeshProxy& proxy, const ProxyRays& rays) {
  for (std::size_t first = 0; first < rays.dx.size(); first += packet) trace_packet(proxy, rays, first);
}

}  // namespace

void trace(const Proxy& proxy, const ProxyRays& rays) {
  std::visit([&](const auto& surface) { trace_surface(surface, rays); }, proxy);
}

}  // namespace mf
