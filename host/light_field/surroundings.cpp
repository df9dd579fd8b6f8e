// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/surroundings.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "host/light_field/distance_march.h"
#include "host/light_field/map_lookup.h"
#include "host/tracing/ray_scene.h"

namespace mf {

namespace {

// Distance along a ray from p (inside) to a sphere about the centre, inverted.
float inverse_to_sphere(const Eigen::Vector3f& from_centre, const Eigen::Vector3f& direction, float inverse_radius) {
  if (inverse_radius <= 0) return 0;
  const float b = from_centre.dot(direction), r = 1 / inverse_radius;
  // A point outside the sphere (a wrong, near distance) still gets a positive one.
  const float along = -b + std::sqrt(std::max(b * b - from_centre.squaredNorm() + r * r, 0.0F));
  constexpr float nearest_m = 0.02F;
  return 1 / std::max(along, nearest_m);
}

// Distance along a ray from p to a mesh's first triangle, inverted.
float inverse_to_mesh(const RayScene& mesh, const Eigen::Vector3f& p, const Eigen::Vector3f& direction) {
  constexpr float nearest_m = 0.02F;  // a table in the mesh, on which the plane lies, hides nothing
  const auto hit = mesh.intersect(p + nearest_m * direction, direction);
  return hit ? 1 / (hit->distance + nearest_m) : 0;
}

}  // namespace

Eigen::Vector2f equal_area_square(const Eigen::Vector3f& d) {
  const Eigen::Vector2f disc = d.head<2>() / std::sqrt(1 + std::max(d.z(), 0.0F));
  const float n = disc.norm();
  const Eigen::Vector2f inside = n > 1 ? Eigen::Vector2f(disc / n) : disc;
  return {0.5F + 0.5F * inside.x(), 0.5F - 0.5F * inside.y()};
}

Eigen::Vector3f equal_area_direction(const Eigen::Vector2f& position) {
  Eigen::Vector2f disc(2 * position.x() - 1, 1 - 2 * position.y());
  if (disc.norm() > 1) disc.normalize();
  const float z = 1 - disc.squaredNorm();
  const Eigen::Vector2f xy = disc * std::sqrt(1 + z);
  return {xy.x(), xy.y(), z};
}

float Surroundings::inverse_distance_of(const Eigen::Vector3f& direction) const {
  if (box) return box->inverse_distance_along(centre_in_world, direction);
  if (mesh) return inverse_to_mesh(*mesh, centre_in_world, direction);
  if (inverse_distance.data.size() == 1) return inverse_distance.data[0];
  const Eigen::Vector2f at = equal_area_square(direction);
  return bilinear(inverse_distance, at.x() * static_cast<float>(inverse_distance.width),
                  at.y() * static_cast<float>(inverse_distance.height));
}

float Surroundings::inverse_distance_along(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const {
  if (box) return box->inverse_distance_along(p, direction);
  if (mesh) return inverse_to_mesh(*mesh, p, direction);
  const Eigen::Vector3f from_centre = p - centre_in_world;
  if (inverse_distance.data.size() == 1) return inverse_to_sphere(from_centre, direction, inverse_distance.data[0]);
  return march_to_surface(inverse_distance, from_centre, direction);
}

Eigen::Vector4f Surroundings::panorama_at(const Eigen::Vector3f& d) const {
  const float turn = std::atan2(d.y(), d.x()) / (2 * std::numbers::pi_v<float>);
  const float u = (turn - std::floor(turn)) * static_cast<float>(panorama.width) - 0.5F;
  const float zenith_angle = std::acos(std::clamp(d.z(), 0.0F, 1.0F)) / (0.5F * std::numbers::pi_v<float>);
  const float v = std::clamp(zenith_angle * static_cast<float>(panorama.height) - 0.5F, 0.0F,
                             static_cast<float>(panorama.height - 1));
  const int x0 = static_cast<int>(std::floor(u)), y0 = static_cast<int>(v), y1 = std::min(y0 + 1, panorama.height - 1);
  const float fx = u - static_cast<float>(x0), fy = v - static_cast<float>(y0);
  const auto texel = [&](int x, int y) -> Eigen::Vector4f {
    const float* t = &panorama.data[panorama.index((x + panorama.width) % panorama.width, y)];
    return t[3] * Eigen::Vector4f(t[0], t[1], t[2], 1);
  };
  const Eigen::Vector4f sum = (texel(x0, y0) * (1 - fx) + texel(x0 + 1, y0) * fx) * (1 - fy) +
                              (texel(x0, y1) * (1 - fx) + texel(x0 + 1, y1) * fx) * fy;
  if (sum.w() <= 0) return Eigen::Vector4f::Zero();
  return {sum.x() / sum.w(), sum.y() / sum.w(), sum.z() / sum.w(), sum.w()};
}

Surroundings sphere_surroundings(const Eigen::Vector3f& centre_in_world, double radius_m) {
  Surroundings s;
  s.centre_in_world = centre_in_world;
  s.inverse_distance = ImageF(1, 1, 1, static_cast<float>(1 / radius_m));
  return s;
}

namespace {

// Fills the map with what the centre sees of the shape.
void draw_map(Surroundings& s, int side) {
  s.inverse_distance = ImageF(side, side, 1);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      s.inverse_distance.at(x, y) = s.inverse_distance_of(equal_area_direction(
          Eigen::Vector2f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F) / static_cast<float>(side)));
}

}  // namespace

Surroundings box_surroundings(const Eigen::Vector3f& centre_in_world, const RoomBox& box) {
  Surroundings s;
  s.centre_in_world = centre_in_world;
  s.box = box;
  constexpr int map_side = 256;
  draw_map(s, map_side);
  return s;
}

Surroundings mesh_surroundings(const Eigen::Vector3f& centre_in_world, std::shared_ptr<const RayScene> mesh,
                               std::string mesh_file) {
  Surroundings s;
  s.centre_in_world = centre_in_world;
  s.mesh = std::move(mesh);
  s.mesh_file = std::move(mesh_file);
  constexpr int map_side = 512;
  draw_map(s, map_side);
  return s;
}

std::string surroundings_name(const Surroundings& s) {
  if (s.is_plane()) return "plane";
  if (s.box) return box_name(*s.box);
  if (!s.mesh_file.empty()) return "mesh:" + s.mesh_file;
  if (s.inverse_distance.data.size() > 1) return "depth";
  const float inverse = s.inverse_distance.data[0];
  return inverse > 0 ? fmt::format("sphere:{:.3g}", 1 / inverse) : "sphere:inf";
}

std::optional<double> parse_sphere(std::string_view text) {
  constexpr std::string_view prefix = "sphere:";
  if (!text.starts_with(prefix)) return std::nullopt;
  text.remove_prefix(prefix.size());
  if (text == "inf") return std::numeric_limits<double>::infinity();
  double radius = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), radius);
  if (error != std::errc{} || end != text.data() + text.size() || !(radius > 0) || !std::isfinite(radius))
    return std::nullopt;
  return radius;
}

}  // namespace mf
