// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/made_capture.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "common/response_curve.h"
#include "common/session.h"
#include "common/virtual_view.h"
#include "host/calibration/calibration.h"

namespace mf::bench {

namespace {

constexpr double black_level = 64;
constexpr double full_scale = 20;  // radiance of the last code: the lamp's
constexpr double reflectance = 0.92;

// What a ray from inside the room sees.
Eigen::Vector3f room(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) {
  const Eigen::Vector3f lamp(0.5F, 0.3F, 1.2F);
  constexpr float lamp_radius = 0.06F;
  const Eigen::Vector3f to = lamp - origin;
  const float along = to.dot(direction);
  if (along > 0 && to.squaredNorm() - along * along < lamp_radius * lamp_radius) return {20, 18, 15};
  const Eigen::Array3f low(-2, -1.6F, -0.8F), high(2, 2, 2.4F);
  const Eigen::Array3f walls = (direction.array() > 0).select(high, low);
  const Eigen::Array3f distance = (walls - origin.array()) / direction.array();
  Eigen::Index axis = 0;
  const float t = distance.minCoeff(&axis);
  const Eigen::Vector3f x = origin + t * direction;
  if (axis == 1 && direction.y() > 0 && std::abs(x.x() + 0.6F) < 0.5F && x.z() > 0.8F && x.z() < 1.8F)
    return {3, 3.3F, 4};
  const float u = x[(axis + 1) % 3], v = x[(axis + 2) % 3];
  const float texture =
      0.35F + 0.12F * std::sin(9 * u) * std::cos(8 * v) + 0.1F * std::sin(31 * u + 17 * v) * std::sin(23 * v);
  return texture *
         Eigen::Vector3f(1, 0.6F + 0.3F * static_cast<float>(axis) / 2, 0.9F - 0.2F * static_cast<float>(axis));
}

CameraModel camera_of(int size_px) {
  CameraModel camera;
  camera.width = camera.height = size_px;
  const double focal = 1.4 * size_px, middle = 0.5 * size_px;
  camera.parameters = {focal, focal, middle, middle, -0.05, 0.01, 1e-4, -2e-4, 0};
  return camera;
}

MirrorTarget target() {
  MirrorTarget t;
  t.family = "tag36h11";
  t.opening_m = {0.34, 0.26};
  t.tags = {{0, 0.034, {-0.195, 0.155}}, {1, 0.034, {0.195, 0.155}}, {2, 0.034, {-0.195, -0.155}}};
  return t;
}

// From the columns of a rotation and an origin.
Rigid3 pose(const Eigen::Vector3d& x, const Eigen::Vector3d& y, const Eigen::Vector3d& z,
            const Eigen::Vector3d& origin) {
  Eigen::Matrix3d r;
  r << x, y, z;
  return {Eigen::Quaterniond(r), origin};
}

Rigid3 world_from_camera() {
  const Eigen::Vector3d at(0, -1.2, 0.9), z = (Eigen::Vector3d(0, 0, 0.03) - at).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  return pose(x, z.cross(x), z, at);
}

// Mirrors over the plane, turned so that each shows the camera light from another direction.
std::vector<Rigid3> mirror_poses(int count) {
  const Rigid3 world_from_cam = world_from_camera();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Rigid3> poses;
  while (static_cast<int>(poses.size()) < count) {
    const Eigen::Vector3d at(0.25 * uniform(random), 0.18 * uniform(random), 0.03 + 0.03 * uniform(random));
    const double up = 0.55 + 0.45 * uniform(random), azimuth = std::numbers::pi * uniform(random);
    const double across = std::sqrt(1 - up * up);
    const Eigen::Vector3d light(across * std::cos(azimuth), across * std::sin(azimuth), up);
    const Eigen::Vector3d to_camera = (world_from_cam.translation - at).normalized();
    const Eigen::Vector3d normal = (light + to_camera).normalized();
    if (normal.dot(to_camera) < 0.35) continue;
    const double roll = 0.5 * uniform(random);
    const Eigen::Vector3d level = Eigen::Vector3d::UnitY().cross(normal).normalized();
    const Eigen::Vector3d x = std::cos(roll) * level + std::sin(roll) * normal.cross(level);
    poses.push_back(world_from_cam.inverse() * pose(x, normal.cross(x), normal, at));
  }
  return poses;
}

// A cheap generator of its own for every pixel: frames are drawn in any order.
float noise(std::uint32_t seed) {
  seed ^= seed >> 16U;
  seed *= 0x7feb352dU;
  seed ^= seed >> 15U;
  seed *= 0x846ca68bU;
  seed ^= seed >> 16U;
  // Two uniform halves summed: a triangle, of variance 1.
  return ((static_cast<float>(seed & 0xffffU) + static_cast<float>(seed >> 16U)) / 65536.0F - 1) * 2.45F;
}

// The ray (x, y, 1) of every pixel, by rows.
std::vector<Eigen::Vector3d> rays_of(const CameraModel& camera) {
  std::vector<Eigen::Vector3d> rays(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  tbb::parallel_for(0, camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x)
      rays[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(x)] =
          camera.unproject({x + 0.5, y + 0.5}).value_or(Eigen::Vector3d::UnitZ());
  });
  return rays;
}

Frame draw(int index, const Rigid3& cam_from_mirror, const CameraModel& camera,
           const std::vector<Eigen::Vector3d>& rays, const ResponseCurve& response) {
  const VirtualView view = mirror_view(cam_from_mirror, target(), camera).value();
  const Rigid3 world_from_cam = world_from_camera();
  const Eigen::Matrix3d turn = world_from_cam.rotation.toRotationMatrix();
  const Eigen::Vector3f centre = (world_from_cam * view.centre_in_cam()).cast<float>();
  const Rigid3 mirror_from_cam = cam_from_mirror.inverse();
  const Eigen::Vector3d camera_in_mirror = mirror_from_cam.translation;
  Eigen::Vector2d low = view.opening_in_img.front(), high = low;
  for (const Eigen::Vector2d& p : view.opening_in_img) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const float codes_per_radiance = static_cast<float>((4095 - black_level) / full_scale * reflectance);
  ImageU16 codes(camera.width, camera.height, 1);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
      float radiance = 0.3F;  // beside the mirror
      if ((pixel.array() >= low.array()).all() && (pixel.array() <= high.array()).all()) {
        const Eigen::Vector3d& ray =
            rays[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(x)];
        const Eigen::Vector3d in_mirror = mirror_from_cam.rotation * ray;
        const Eigen::Vector3d hit = camera_in_mirror - camera_in_mirror.z() / in_mirror.z() * in_mirror;
        if (in_mirror.z() < 0 && std::abs(hit.x()) < 0.17 && std::abs(hit.y()) < 0.13) {
          const Eigen::Vector3d reflected(in_mirror.x(), in_mirror.y(), -in_mirror.z());
          const Eigen::Vector3d out = turn * (cam_from_mirror.rotation * reflected);
          radiance = room(centre, out.normalized().cast<float>())[colour_at(PixelLayout::bayer_rg, x, y)];
        }
      }
      const float signal = radiance * codes_per_radiance;
      const float sigma = std::sqrt(1 + 0.4F * signal);
      const std::uint32_t seed = (static_cast<std::uint32_t>(index) * 1024 + static_cast<std::uint32_t>(y)) * 1024 +
                                 static_cast<std::uint32_t>(x);
      codes.at(x, y) = static_cast<std::uint16_t>(
          std::clamp(static_cast<float>(response.black_level) + signal + sigma * noise(seed), 0.0F, 4095.0F));
    }
  FrameInfo info;
  info.name = fmt::format("{:05}.png", index);
  info.exposure_s = 1;
  return {info, codes};
}

void write_records(const std::filesystem::path& session, const std::vector<Rigid3>& poses, const CameraModel& camera,
                   const ResponseCurve& response) {
  std::ofstream(session / "response.json") << to_json(response).dump();
  Calibration calibration;
  calibration.camera = camera;
  calibration.cam_from_world = world_from_camera().inverse();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    MirrorPose p;
    p.name = fmt::format("{:05}.png", i);
    p.cam_from_mirror = poses[i];
    p.used = true;
    calibration.frames.push_back(p);
  }
  write_calibration(session / "calibration.json", calibration);
}

}  // namespace

void make_capture(const std::filesystem::path& session, const MadeCaptureOptions& options) {
  if (std::filesystem::exists(session / "calibration.json")) return;
  std::filesystem::remove_all(session);
  SessionHeader header;
  header.format = *parse_pixel_format("BayerRG12");
  header.width = header.height = options.size_px;
  header.black_level_hint = black_level;
  header.mirror_reflectance = reflectance;
  header.target = target();
  const CameraModel camera = camera_of(options.size_px);
  const ResponseCurve response = linear_response(12, black_level, full_scale, 3);
  const std::vector<Rigid3> poses = mirror_poses(options.frames);
  const std::vector<Eigen::Vector3d> rays = rays_of(camera);
  SessionWriter writer(session, header, {SessionWriter::Durability::batches});
  constexpr int batch = 32;
  for (int first = 0; first < options.frames; first += batch) {
    const int count = std::min(batch, options.frames - first);
    std::vector<EncodedFrame> encoded(static_cast<std::size_t>(count));
    tbb::parallel_for(0, count, [&](int i) {
      encoded[static_cast<std::size_t>(i)] =
          writer.encode(draw(first + i, poses[static_cast<std::size_t>(first + i)], camera, rays, response));
    });
    for (EncodedFrame& frame : encoded) writer.append(std::move(frame));
  }
  writer.finish();
  write_records(session, poses, camera, response);
}

}  // namespace mf::bench
