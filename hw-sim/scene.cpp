// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace mf::sim {

namespace {

using Eigen::Vector3f;

const Rgb dark_square{0.08F, 0.08F, 0.09F};
constexpr double tag_size_m = 0.08;

Rgb albedo(const PlainPaint& paint, const Vector3f&) {
  return paint.albedo;
}

Rgb albedo(const StripedPaint& paint, const Vector3f& x) {
  // The stripes run across x + y, so that they show on any vertical wall.
  const float phase = (x.x() + x.y()) / paint.period_m * 2 * std::numbers::pi_v<float>;
  return paint.albedo * (1 - paint.contrast * (0.5F + 0.5F * std::sin(phase)));
}

Rgb albedo(const TablePaint& paint, const Vector3f& x) {
  const Eigen::Vector2f p = x.head<2>();
  if (const auto white = paint.tags.is_white(p)) return *white ? paper : ink;
  const Eigen::Vector2f size = paint.board.size_m.cast<float>();
  const Eigen::Vector2f in_board = p - paint.board.centre_in_world.head<2>().cast<float>() + 0.5F * size;
  if (in_board.x() < 0 || in_board.y() < 0 || in_board.x() >= size.x() || in_board.y() >= size.y()) return paint.wood;
  const int column = static_cast<int>(in_board.x() / size.x() * static_cast<float>(paint.board.squares[0]));
  const int row = static_cast<int>(in_board.y() / size.y() * static_cast<float>(paint.board.squares[1]));
  return (column + row) % 2 == 0 ? dark_square : paper;
}

Mesh quad(const Vector3f& origin, const Vector3f& edge_u, const Vector3f& edge_v) {
  return {{origin, origin + edge_u, origin + edge_u + edge_v, origin + edge_v}, {{0, 1, 2}, {0, 2, 3}}};
}

// A pointed oval of unit length along `along`, half as wide across.
Mesh leaf(const Vector3f& centre, const Vector3f& along, const Vector3f& across) {
  Mesh mesh;
  constexpr int points = 12;
  mesh.vertices.push_back(centre);
  for (int i = 0; i < points; ++i) {
    const float a = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / points;
    const float s = std::sin(a);
    mesh.vertices.push_back(centre + 0.5F * std::cos(a) * along + 0.25F * s * std::abs(s) * across);
  }
  for (std::uint32_t i = 0; i < points; ++i) mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % points});
  return mesh;
}

// Leaves between the lamp and the table's middle. Halfway, so that their shadows are twice their size and as soft as
// the lamp is wide.
void add_leaves(Scene& scene, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](float lowest, float highest) {
    return lowest + (highest - lowest) * static_cast<float>(random() >> 40U) * 0x1p-24F;
  };
  const Vector3f towards = scene.lamp.centre_in_world.normalized();
  const Vector3f right = towards.cross(Vector3f::UnitZ()).normalized();
  const Vector3f up = right.cross(towards);
  constexpr float length_m = 0.085F;
  constexpr std::array<std::array<float, 2>, 8> places{{{-0.07F, 0.02F},
                                                        {-0.01F, 0.055F},
                                                        {0.045F, 0.015F},
                                                        {-0.02F, -0.03F},
                                                        {0.07F, -0.05F},
                                                        {-0.1F, -0.06F},
                                                        {0.11F, 0.06F},
                                                        {0.2F, 0.0F}}};
  for (const auto& [x, y] : places) {
    const Vector3f centre = scene.lamp.centre_in_world * uniform(0.42F, 0.48F) + right * (x + uniform(-0.01F, 0.01F)) +
                            up * (y + uniform(-0.01F, 0.01F));
    const float turn = uniform(0, std::numbers::pi_v<float>);
    const Vector3f along = std::cos(turn) * right + std::sin(turn) * up + uniform(-0.4F, 0.4F) * towards;
    const Vector3f across = -std::sin(turn) * right + std::cos(turn) * up;
    scene.surfaces.push_back({leaf(centre, length_m * along, length_m * across), PlainPaint{{0.1F, 0.32F, 0.06F}}});
  }
}

WorldTarget desk_world() {
  WorldTarget world;
  world.family = "tag36h11";
  world.tags = {{100, tag_size_m, {-0.28, -0.2, 0}},
                {101, tag_size_m, {0.28, -0.2, 0}},
                {102, tag_size_m, {0.28, 0.22, 0}},
                {103, tag_size_m, {-0.28, 0.22, 0}}};
  world.checkerboard = Checkerboard{{8, 8}, {0, 0, 0}, {0.4, 0.4}};
  return world;
}

float smooth_box(float x, float half_width, float edge) {
  return std::clamp((half_width - std::abs(x)) / edge + 0.5F, 0.0F, 1.0F);
}

}  // namespace

Rgb albedo_at(const Paint& paint, const Vector3f& x_in_world) {
  return std::visit([&](const auto& p) { return albedo(p, x_in_world); }, paint);
}

Rgb surroundings(const Vector3f& direction) {
  const float azimuth = std::atan2(direction.y(), direction.x());
  const float elevation = std::asin(std::clamp(direction.z(), -1.0F, 1.0F));
  const float height = 0.5F + 0.5F * direction.z();
  const float beams = 0.75F + 0.25F * std::sin(14 * azimuth) * std::cos(3 * elevation);
  Rgb light = beams * ((1 - height) * Rgb(0.1F, 0.08F, 0.07F) + height * Rgb(0.26F, 0.28F, 0.33F));
  struct Window {
    float azimuth, elevation, half_width, half_height;
  };
  constexpr std::array<Window, 3> windows{
      {{-1.9F, 0.5F, 0.28F, 0.16F}, {-1.15F, 0.5F, 0.28F, 0.16F}, {0.25F, 0.9F, 0.2F, 0.1F}}};
  for (const Window& w : windows) {
    const float inside = smooth_box(azimuth - w.azimuth, w.half_width, 0.04F) *
                         smooth_box(elevation - w.elevation, w.half_height, 0.04F);
    light += inside * Rgb(0.5F, 0.6F, 0.75F);
  }
  return light;
}

Scene desk_scene(std::uint64_t seed) {
  Scene scene;
  scene.world = desk_world();
  TablePaint table{{0.36F, 0.22F, 0.13F}, *scene.world.checkerboard, {}};
  for (const WorldTag& tag : scene.world.tags)
    table.tags.add(scene.world.family, tag.id, tag.centre_in_world.head<2>(), tag.size_m);
  scene.lamp = {{0.42F, 0.52F, 0.74F}, 0.04F, {520, 420, 290}};
  scene.surfaces.push_back({quad({-0.9F, -0.7F, 0}, {1.8F, 0, 0}, {0, 1.5F, 0}), table});
  const Rgb cream{0.7F, 0.62F, 0.48F};
  const Rgb red{0.62F, 0.12F, 0.08F};
  scene.surfaces.push_back({quad({-0.9F, 1.15F, 0.1F}, {1.5F, 0, 0}, {0, 0, 0.9F}), StripedPaint{cream, 0.24F, 0.4F}});
  scene.surfaces.push_back({quad({-1.05F, -0.5F, 0.1F}, {0, 1.3F, 0}, {0, 0, 0.8F}), StripedPaint{red, 0.2F, 0.4F}});
  add_leaves(scene, seed);
  return scene;
}

MirrorTarget desk_mirror() {
  MirrorTarget target;
  target.family = "tag36h11";
  target.opening_m = {0.34, 0.26};
  constexpr double size = 0.048;
  constexpr double x = 0.201;
  constexpr double y = 0.161;
  int id = 0;
  for (const double row : {y, -y})
    for (int i = 0; i <= 6; ++i) target.tags.push_back({id++, size, {-x + 2 * x * i / 6, row}});
  for (const double column : {-x, x})
    for (int i = 1; i <= 4; ++i) target.tags.push_back({id++, size, {column, -y + 2 * y * i / 5}});
  return target;
}

Mesh trefoil_knot(double clearance_m) {
  constexpr std::uint32_t along_count = 240;
  constexpr std::uint32_t around_count = 28;
  constexpr double scale_m = 0.026;
  constexpr double tube_m = 0.016;
  const auto curve = [&](double t) -> Eigen::Vector3d {
    return Eigen::Vector3d(std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t)) *
           scale_m;
  };
  Mesh mesh;
  for (std::uint32_t i = 0; i < along_count; ++i) {
    const double t = 2 * std::numbers::pi * i / along_count;
    const Eigen::Vector3d tangent = (curve(t + 1e-4) - curve(t - 1e-4)).normalized();
    // The curve never runs along z, so z completes a frame that closes without a twist.
    const Eigen::Vector3d side = tangent.cross(Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d up = side.cross(tangent);
    for (std::uint32_t j = 0; j < around_count; ++j) {
      const double a = 2 * std::numbers::pi * j / around_count;
      mesh.vertices.push_back((curve(t) + tube_m * (std::cos(a) * side + std::sin(a) * up)).cast<float>());
      const std::uint32_t next_i = (i + 1) % along_count * around_count;
      const std::uint32_t next_j = (j + 1) % around_count;
      const std::uint32_t at = i * around_count;
      mesh.triangles.push_back({at + j, next_i + j, next_i + next_j});
      mesh.triangles.push_back({at + j, next_i + next_j, at + next_j});
    }
  }
  // Stood up and tilted a little: more of it casts a shadow.
  const Eigen::Matrix3f turn = Eigen::AngleAxisf(1.15F, Vector3f::UnitX()).toRotationMatrix();
  float lowest = std::numeric_limits<float>::max();
  for (Vector3f& v : mesh.vertices) {
    v = turn * v;
    lowest = std::min(lowest, v.z());
  }
  for (Vector3f& v : mesh.vertices) v.z() += static_cast<float>(clearance_m) - lowest;
  return mesh;
}

}  // namespace mf::sim
