// SPDX-License-Identifier: Apache-2.0
#include "host/tracing/ray_scene.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "common/check.h"

namespace mf {

RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

RayScene::RayScene(const TriangleMesh& mesh)
    : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)), bounds_(bounds_of(mesh)) {
  check(device_ != nullptr && scene_ != nullptr, "Embree starts");
  // Robust: no ray slips between two triangles that share an edge, which would leak light through a closed mesh.
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  if (!mesh.triangles.empty()) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             sizeof(Eigen::Vector3f), mesh.positions.size());
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            sizeof(mesh.triangles[0]), mesh.triangles.size());
    check(vertices != nullptr && indices != nullptr, "Embree holds the mesh");
    std::copy(mesh.positions.begin(), mesh.positions.end(), static_cast<Eigen::Vector3f*>(vertices));
    std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene_);
  const float extent = bounds_.centre.cwiseAbs().maxCoeff() + bounds_.radius;
  surface_offset_m_ = 2e-5F * extent;  // 170 rounding steps of the largest coordinate; 4 µm for a 20 cm object
}

RayScene::RayScene(RayScene&& other) noexcept
    : device_(std::exchange(other.device_, nullptr)),
      scene_(std::exchange(other.scene_, nullptr)),
      bounds_(std::move(other.bounds_)),  // NOLINT(performance-move-const-arg): the other check asks for it
      surface_offset_m_(other.surface_offset_m_) {}

RayScene::~RayScene() {
  if (scene_ != nullptr) rtcReleaseScene(scene_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

std::optional<RayScene::Hit> RayScene::intersect(const Eigen::Vector3f& origin,
                                                 const Eigen::Vector3f& direction) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray{};
  ray.ray.org_x = origin.x();
  ray.ray.org_y = origin.y();
  ray.ray.org_z = origin.z();
  ray.ray.dir_x = direction.x();
  ray.ray.dir_y = direction.y();
  ray.ray.dir_z = direction.z();
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{ray.hit.primID, ray.ray.tfar, ray.hit.u, ray.hit.v};
}

}  // namespace mf
