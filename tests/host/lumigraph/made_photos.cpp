// SPDX-License-Identifier: Apache-2.0
#include "tests/host/lumigraph/made_photos.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>

#include "host/lumigraph/proxy_rays.h"

namespace mf::test {

namespace {

constexpr double pi = std::numbers::pi;

Eigen::Vector3f ray_colour(const Proxy& walls, const Paint& paint, const Eigen::Vector3f& origin,
                           const Eigen::Vector3f& direction) {
  std::array<float, 7> value{direction.x(), direction.y(), direction.z()};
  const std::span<float> v(value);
  trace(walls, {origin, v.subspan(0, 1), v.subspan(1, 1), v.subspan(2, 1), v.subspan(3, 1), v.subspan(4, 1),
                v.subspan(5, 1), v.subspan(6, 1)});
  return std::isfinite(value[3]) ? paint(origin + value[3] * direction) : Eigen::Vector3f::Zero();
}

}  // namespace

Paint blotches(float finest) {
  return [finest](const Eigen::Vector3f& x) {
    Eigen::Vector3f colour = Eigen::Vector3f::Constant(0.5F);
    for (int octave = 0; octave < 3; ++octave) {
      const float frequency = 2 * std::numbers::pi_v<float> / (finest * std::exp2(1.7F * static_cast<float>(octave)));
      for (int c = 0; c < 3; ++c) {
        const auto shift = static_cast<float>(c + 3 * octave);
        colour[c] += 0.16F * std::sin(frequency * (x.x() + 0.31F * x.z()) + shift) *
                     std::cos(frequency * (0.8F * x.y() - 0.53F * x.z()) - 1.7F * shift);
      }
    }
    return colour;
  };
}

CameraModel pinhole(int size_px, double field_of_view_deg) {
  CameraModel camera;
  camera.width = camera.height = size_px;
  const double focal = size_px / (2 * std::tan(field_of_view_deg * pi / 360));
  camera.parameters = {focal, focal, size_px / 2.0, size_px / 2.0, 0, 0, 0, 0, 0};
  return camera;
}

Rigid3 looking(const Eigen::Vector3d& from, const Eigen::Vector3d& at) {
  const Eigen::Vector3d z = (at - from).normalized();
  const Eigen::Vector3d up = std::abs(z.z()) > 0.99 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  Eigen::Matrix3d cam_from_world;
  cam_from_world.row(2) = z.transpose();
  cam_from_world.row(0) = z.cross(up).normalized().transpose();
  cam_from_world.row(1) = z.cross(cam_from_world.row(0).transpose()).transpose();
  return {Eigen::Quaterniond(cam_from_world), -(cam_from_world * from)};
}

ImageF true_picture(const View& view, const Proxy& walls, const Paint& paint, int samples) {
  ImageF picture(view.camera.width, view.camera.height, 3);
  const Rigid3 world_from_cam = view.cam_from_world.inverse();
  const Eigen::Vector3f eye = world_from_cam.translation.cast<float>();
  tbb::parallel_for(0, picture.height, [&](int y) {
    for (int x = 0; x < picture.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int s = 0; s < samples * samples; ++s) {
        const Eigen::Vector2d pixel(x + (s % samples + 0.5) / samples, y + (s / samples + 0.5) / samples);
        const Eigen::Vector3d direction = world_from_cam.rotation * view.camera.unproject(pixel).value();
        sum += ray_colour(walls, paint, eye, direction.cast<float>());
      }
      for (int c = 0; c < 3; ++c) picture.at(x, y, c) = sum[c] / static_cast<float>(samples * samples);
    }
  });
  return picture;
}

PosedPhoto photo_of(const std::string& name, const View& view, const Proxy& walls, const Paint& paint, int samples) {
  return {name, view.camera, view.cam_from_world, true_picture(view, walls, paint, samples), {}, {}};
}

ImageU8 codes_of(const ImageF& linear) {
  ImageU8 codes(linear.width, linear.height, linear.channels);
  for (std::size_t i = 0; i < codes.data.size(); ++i)
    codes.data[i] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(linear.data[i], 0.0F, 1.0F)));
  return codes;
}

std::vector<View> cap_of_views(int count, double radius, double cap_deg, const CameraModel& camera) {
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    const double angle = i * pi * (3 - std::sqrt(5.0));
    const double height = 1 - (1 - std::cos(cap_deg * pi / 180)) * (i + 0.5) / count;
    const double across = std::sqrt(1 - height * height);
    views.push_back(
        {camera, looking(radius * Eigen::Vector3d(across * std::cos(angle), across * std::sin(angle), height),
                         Eigen::Vector3d::Zero())});
  }
  return views;
}

TriangleMesh bumpy_ball_on_floor(int steps) {
  TriangleMesh mesh;
  const auto add = [&](const Eigen::Vector3f& position, const Eigen::Vector3f& normal) {
    mesh.positions.push_back(position);
    mesh.normals.push_back(normal);
    mesh.albedo.emplace_back(0.5F, 0.5F, 0.5F);
  };
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j) {
      const double theta = pi * i / steps;
      const double phi = 2 * pi * j / steps;
      const Eigen::Vector3d n(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      const double radius = 1 + 0.05 * std::sin(6 * theta) * std::cos(5 * phi) * std::sin(theta);
      add((radius * n).cast<float>(), n.cast<float>());
    }
  const auto side = static_cast<std::uint32_t>(steps + 1);
  for (std::uint32_t i = 0; i + 1 < side; ++i)
    for (std::uint32_t j = 0; j + 1 < side; ++j) {
      const std::uint32_t a = i * side + j;
      mesh.triangles.push_back({a, a + side, a + 1});
      mesh.triangles.push_back({a + 1, a + side, a + side + 1});
    }
  const auto floor = static_cast<std::uint32_t>(mesh.positions.size());
  for (const float y : {-6.0F, 6.0F})
    for (const float x : {-6.0F, 6.0F}) add({x, y, -1.2F}, Eigen::Vector3f::UnitZ());
  mesh.triangles.push_back({floor, floor + 1, floor + 2});
  mesh.triangles.push_back({floor + 1, floor + 3, floor + 2});
  return mesh;
}

}  // namespace mf::test
