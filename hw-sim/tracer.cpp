// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/tracer.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "common/check.h"
#include "hw-sim/parallel.h"

namespace mf::sim {

namespace {

using Eigen::Vector3f;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float epsilon_m = 1e-4F;  // leaves a surface behind: single precision resolves 1e-7 at a metre
constexpr int max_diffuse_bounces = 1;
constexpr int max_mirror_bounces = 4;  // the plate mirrors its own table and back
constexpr float pi = std::numbers::pi_v<float>;

struct DeviceDeleter {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct SceneDeleter {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, DeviceDeleter>;
using EmbreeScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, SceneDeleter>;

void attach(RTCDevice device, RTCScene scene, const Mesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), mesh.vertices.size()));
  auto* triangles = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.triangles.size()));
  check(vertices != nullptr && triangles != nullptr, "Embree gives buffers");
  for (const Vector3f& v : mesh.vertices) vertices = std::copy(v.data(), v.data() + 3, vertices);
  for (const auto& t : mesh.triangles) triangles = std::copy(t.begin(), t.end(), triangles);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);  // ids count up from 0: the surface's index
  rtcReleaseGeometry(geometry);
}

RTCRay embree_ray(const Ray& ray, float farthest) {
  RTCRay r{};
  r.org_x = ray.origin.x();
  r.org_y = ray.origin.y();
  r.org_z = ray.origin.z();
  r.dir_x = ray.direction.x();
  r.dir_y = ray.direction.y();
  r.dir_z = ray.direction.z();
  r.tnear = epsilon_m;
  r.tfar = farthest;
  r.mask = 0xffffffffU;
  return r;
}

// A unit vector by (sine, cosine) of the angle to `axis` and an azimuth around it.
Vector3f around(const Vector3f& axis, float sin_angle, float cos_angle, float azimuth) {
  const Vector3f tangent = axis.unitOrthogonal();
  return cos_angle * axis + sin_angle * (std::cos(azimuth) * tangent + std::sin(azimuth) * axis.cross(tangent));
}

Vector3f cosine_direction(const Vector3f& normal, const Eigen::Vector2f& u) {
  return around(normal, std::sqrt(u.x()), std::sqrt(1 - u.x()), 2 * pi * u.y());
}

float lamp_distance(const Lamp& lamp, const Ray& ray) {
  const Vector3f to_centre = lamp.centre_in_world - ray.origin;
  const float along = to_centre.dot(ray.direction);
  const float miss2 = (to_centre - along * ray.direction).squaredNorm();
  const float r2 = lamp.radius_m * lamp.radius_m;
  if (along <= 0 || miss2 >= r2) return infinity;
  return along - std::sqrt(r2 - miss2);
}

}  // namespace

struct Tracer::Impl {
  const Scene& scene;
  const MirrorPlate* plate;
  Device device;
  EmbreeScene embree;

  struct SurfaceHit {
    Vector3f x;
    Vector3f normal;  // towards the ray's origin
    Rgb albedo;
  };

  [[nodiscard]] bool is_occluded(const Ray& ray, float farthest,
                                 const std::optional<MirrorPlate::Placement>& mirror) const {
    if (mirror && plate->intersect(*mirror, ray, epsilon_m, farthest)) return true;
    RTCRay r = embree_ray(ray, farthest);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(embree.get(), &context, &r);
    return r.tfar < 0;
  }

  [[nodiscard]] RTCRayHit trace(const Ray& ray) const {
    RTCRayHit hit{};
    hit.ray = embree_ray(ray, infinity);
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(embree.get(), &context, &hit);
    return hit;
  }

  [[nodiscard]] SurfaceHit surface_hit(const Ray& ray, const RTCRayHit& hit) const {
    SurfaceHit s;
    s.x = ray.origin + hit.ray.tfar * ray.direction;
    s.normal = Vector3f(hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z).normalized();
    if (s.normal.dot(ray.direction) > 0) s.normal = -s.normal;
    s.albedo = albedo_at(scene.surfaces[hit.hit.geomID].paint, s.x);
    return s;
  }

  [[nodiscard]] SurfaceHit plate_surface(const Ray& ray, const MirrorPlate::Placement& placement,
                                         const MirrorPlate::Hit& hit) const {
    return {ray.origin + hit.distance * ray.direction, placement.normal(hit.front), plate->albedo(hit)};
  }

  // Light from the lamp that a Lambertian surface sends back, one shadow ray.
  [[nodiscard]] Rgb lamp_light(const SurfaceHit& s, const std::optional<MirrorPlate::Placement>& mirror,
                               const Eigen::Vector2f& u) const {
    const Vector3f to_centre = scene.lamp.centre_in_world - s.x;
    const float distance = to_centre.norm();
    const float sin2_max = std::pow(scene.lamp.radius_m / distance, 2.0F);
    if (sin2_max >= 1) return Rgb::Zero();
    const float one_minus_cos_max = sin2_max / (1 + std::sqrt(1 - sin2_max));  // no cancellation for small lamps
    const float cos_angle = 1 - u.x() * one_minus_cos_max;
    const Vector3f direction =
        around(to_centre / distance, std::sqrt(std::max(0.0F, 1 - cos_angle * cos_angle)), cos_angle, 2 * pi * u.y());
    const float cosine = s.normal.dot(direction);
    if (cosine <= 0 || is_occluded({s.x, direction}, distance - scene.lamp.radius_m, mirror)) return Rgb::Zero();
    return s.albedo / pi * scene.lamp.radiance * (cosine * 2 * pi * one_minus_cos_max);
  }

  // Likewise from the panorama, whose bright spots a diffuse reflection would hardly ever find.
  [[nodiscard]] Rgb panorama_light(const SurfaceHit& s, const std::optional<MirrorPlate::Placement>& mirror,
                                   const Eigen::Vector2f& u) const {
    const EnvironmentMap::Drawn drawn = scene.panorama->draw(u);
    const float cosine = s.normal.dot(drawn.direction);
    constexpr float beyond_all = 1e6F;
    if (cosine <= 0 || is_occluded({s.x, drawn.direction}, beyond_all, mirror)) return Rgb::Zero();
    return s.albedo / pi * drawn.radiance * (cosine / drawn.density);
  }
};

Tracer::Tracer(const Scene& scene, const MirrorPlate* plate)
    : impl_(new Impl{scene, plate, Device(rtcNewDevice("threads=1")), nullptr}) {
  check(impl_->device != nullptr, "Embree starts");
  impl_->embree.reset(rtcNewScene(impl_->device.get()));
  rtcSetSceneFlags(impl_->embree.get(), RTC_SCENE_FLAG_ROBUST);
  for (const Surface& surface : scene.surfaces) attach(impl_->device.get(), impl_->embree.get(), surface.mesh);
  rtcCommitScene(impl_->embree.get());
}

Tracer::Tracer(Tracer&&) noexcept = default;
Tracer::~Tracer() = default;

Rgb Tracer::radiance(const Ray& camera_ray, const std::optional<MirrorPlate::Placement>& mirror,
                     Sampler& sampler) const {
  Rgb sum = Rgb::Zero();
  Rgb throughput = Rgb::Ones();
  Ray ray = camera_ray;
  bool lamp_counts = true;  // after a diffuse reflection the lamp has been sampled already
  int mirror_bounces = 0;
  for (int diffuse_bounces = 0; diffuse_bounces <= max_diffuse_bounces;) {
    const RTCRayHit hit = impl_->trace(ray);
    const float lamp = lamp_distance(impl_->scene.lamp, ray);
    const float nearest = std::min(hit.ray.tfar, lamp);
    std::optional<MirrorPlate::Hit> plate_hit;
    if (mirror) plate_hit = impl_->plate->intersect(*mirror, ray, epsilon_m, nearest);

    if (plate_hit && impl_->plate->is_mirror(*plate_hit)) {
      if (++mirror_bounces > max_mirror_bounces) break;
      throughput *= impl_->plate->reflectance();
      ray = {ray.origin + plate_hit->distance * ray.direction, reflect(ray.direction, mirror->normal(true))};
      continue;
    }
    if (!plate_hit && lamp < hit.ray.tfar) {
      if (lamp_counts) sum += throughput * impl_->scene.lamp.radiance;
      break;
    }
    if (!plate_hit && hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
      // A panorama was drawn from at the surface before, as the lamp was.
      if (const EnvironmentMap* panorama = impl_->scene.panorama.get())
        sum += lamp_counts ? Rgb(throughput * panorama->radiance(ray.direction)) : Rgb(Rgb::Zero());
      else
        sum += throughput * surroundings(ray.direction);
      break;
    }
    const Impl::SurfaceHit s =
        plate_hit ? impl_->plate_surface(ray, *mirror, *plate_hit) : impl_->surface_hit(ray, hit);
    sum += throughput * impl_->lamp_light(s, mirror, sampler.next_2d());
    if (impl_->scene.panorama) sum += throughput * impl_->panorama_light(s, mirror, sampler.next_2d());
    throughput *= s.albedo;
    ray = {s.x, cosine_direction(s.normal, sampler.next_2d())};
    lamp_counts = false;
    ++diffuse_bounces;
  }
  return sum;
}

namespace {

// `mirrors`: where the plate is, if it is there, at equal steps through the exposure.
Rgb trace_pixel(const Tracer& tracer, const Shot& shot, const Rigid3& world_from_cam,
                std::span<const std::optional<MirrorPlate::Placement>> mirrors, int x, int y) {
  Sampler sampler(mix(shot.seed, (static_cast<std::uint64_t>(y) << 32U) + static_cast<std::uint64_t>(x)));
  const Vector3f origin = world_from_cam.translation.cast<float>();
  Rgb sum = Rgb::Zero();
  for (int s = 0; s < shot.samples; ++s) {
    sampler.start_sample(s);
    const Eigen::Vector2d pixel = Eigen::Vector2d(x, y) + sampler.next_2d().cast<double>();
    const std::optional<Eigen::Vector3d> in_cam = shot.camera.unproject(pixel);
    if (!in_cam) continue;
    const Vector3f direction = (world_from_cam.rotation * in_cam->normalized()).cast<float>();
    // Neighbours see other moments: what is left of the steps is noise, not ghosts.
    const std::size_t moment = static_cast<std::size_t>(s + 3 * x + 5 * y) % mirrors.size();
    sum += tracer.radiance({origin, direction}, mirrors[moment], sampler);
  }
  return sum / static_cast<float>(shot.samples);
}

}  // namespace

ImageF render(const Tracer& tracer, const Shot& shot) {
  check(shot.samples > 0, "a pixel has samples");
  ImageF picture(shot.camera.width, shot.camera.height, 3);
  const Rigid3 world_from_cam = shot.cam_from_world.inverse();
  std::vector<std::optional<MirrorPlate::Placement>> mirrors(1);
  if (shot.world_from_mirror) mirrors[0].emplace(*shot.world_from_mirror);
  for (const Rigid3& pose : shot.later) mirrors.emplace_back(pose);
  const Region& r = shot.region;
  check(r.x0 >= 0 && r.y0 >= 0 && r.x1 <= picture.width && r.y1 <= picture.height, "the region lies in the picture");
  parallel_for(r.y0, r.y1, [&](int y) {
    for (int x = r.x0; x < r.x1; ++x) {
      const Rgb value = trace_pixel(tracer, shot, world_from_cam, mirrors, x, y);
      std::copy(value.data(), value.data() + 3, &picture.at(x, y));
    }
  });
  return picture;
}

ImageF render_probe(const Tracer& tracer, const Vector3f& at_in_world, int width, int samples, std::uint64_t seed) {
  ImageF picture(width, width / 2, 3);
  const float pixel_angle = 2 * pi / static_cast<float>(width);
  parallel_for(0, picture.height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      Sampler sampler(mix(seed, (static_cast<std::uint64_t>(y) << 32U) + static_cast<std::uint64_t>(x)));
      Rgb sum = Rgb::Zero();
      for (int s = 0; s < samples; ++s) {
        sampler.start_sample(s);
        const Eigen::Vector2f jitter = sampler.next_2d();
        const float polar = (static_cast<float>(y) + jitter.y()) * pixel_angle;       // from the top, +Z
        const float right = (static_cast<float>(x) + jitter.x()) * pixel_angle - pi;  // from the centre, +Y, to +X
        const Vector3f direction(std::sin(polar) * std::sin(right), std::sin(polar) * std::cos(right), std::cos(polar));
        sum += tracer.radiance({at_in_world, direction}, std::nullopt, sampler);
      }
      sum /= static_cast<float>(samples);
      std::copy(sum.data(), sum.data() + 3, &picture.at(x, y));
    }
  });
  return picture;
}

}  // namespace mf::sim
