// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/proxy_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "common/error.h"
#include "host/io/mesh.h"
#include "host/light_field/room_search.h"
#include "host/tracing/ray_scene.h"

namespace mf {

namespace {

constexpr std::string_view mesh_prefix = "mesh:";

std::array<Eigen::Vector3f, 4> corners_of(const PlaneRectangle& r) {
  const auto corner = [&](double x, double y) -> Eigen::Vector3f {
    return (r.world_from_plane * Eigen::Vector3d(x, y, 0)).cast<float>();
  };
  return {corner(r.min_m.x(), r.min_m.y()), corner(r.max_m.x(), r.min_m.y()), corner(r.max_m.x(), r.max_m.y()),
          corner(r.min_m.x(), r.max_m.y())};
}

Surroundings given_box(const RoomBox& box, const PlaneRectangle& rectangle) {
  for (const Eigen::Vector3f& corner : corners_of(rectangle))
    if (!box.holds(corner))
      throw InputError("resample", "--proxy",
                       "the box does not hold the plane's rectangle: give its walls around it in world metres, as "
                       "box:X0,Y0,X1,Y1,H");
  return box_surroundings(centre_of(rectangle), box);
}

Surroundings given_sphere(double radius_m, const PlaneRectangle& rectangle) {
  const double least_m = 0.5 * rectangle.size_m().norm();
  if (radius_m <= least_m)
    throw InputError("resample", "--proxy",
                     fmt::format("the sphere does not hold the plane's rectangle: give a radius above {:.2g} m, where "
                                 "the light comes from",
                                 least_m));
  return sphere_surroundings(centre_of(rectangle), radius_m);
}

Surroundings given_mesh(const std::string& file, const PlaneRectangle& rectangle) {
  auto mesh = std::make_shared<const RayScene>(read_mesh(file));
  Surroundings s =
      mesh_surroundings(centre_of(rectangle), std::move(mesh), std::filesystem::path(file).filename().string());
  const auto& distances = s.inverse_distance.data;
  if (std::all_of(distances.begin(), distances.end(), [](float inverse) { return inverse <= 0; }))
    throw InputError(file, "", "is not seen from the plane: it must surround it, in world coordinates, metres, Z-up");
  return s;
}

}  // namespace

std::optional<std::string> proxy_fault(const std::string& proxy) {
  for (const char* name : {"auto", "sphere", "box", "plane"})
    if (proxy == name) return std::nullopt;
  if (parse_sphere(proxy) || parse_box(proxy)) return std::nullopt;
  if (proxy.starts_with(mesh_prefix) && proxy.size() > mesh_prefix.size()) return std::nullopt;
  return "must be auto, sphere, sphere:R (metres), sphere:inf, box, box:X0,Y0,X1,Y1,H (metres), mesh:FILE or plane";
}

ProxyChoice choose_proxy(const std::vector<FieldView>& views, const PlaneRectangle& rectangle, const std::string& proxy,
                         int k, std::span<const Emitter> emitters, const Team& team) {
  if (proxy == "plane") return {};
  if (proxy == "auto") return {find_surroundings(sweep_surroundings(views, rectangle, team), emitters), {}};
  if (proxy == "box")
    return {box_surroundings(centre_of(rectangle), fit_room(sweep_surroundings(views, rectangle, team))), {}};
  if (const auto radius = parse_sphere(proxy)) return {given_sphere(*radius, rectangle), {}};
  if (const auto box = parse_box(proxy)) return {given_box(*box, rectangle), {}};
  if (proxy.starts_with(mesh_prefix)) return {given_mesh(proxy.substr(mesh_prefix.size()), rectangle), {}};
  std::vector<SphereScore> scores = score_spheres(views, rectangle, k);
  const auto best = std::min_element(scores.begin(), scores.end(), [](const SphereScore& a, const SphereScore& b) {
    return a.inconsistency < b.inconsistency;
  });
  const double radius_m = best->radius_m;
  return {sphere_surroundings(centre_of(rectangle), radius_m), std::move(scores)};
}

}  // namespace mf
