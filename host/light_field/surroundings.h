// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/image.h"
#include "host/light_field/room_box.h"

namespace mf {

class RayScene;

// What the light comes from: the proxy on which captured views are focused (docs/light_field.md, "Focus").
//
// A star-shaped surface about `centre`: for each direction of the upper hemisphere the inverse distance to what is seen
// there, 1/metres (0: so far that no view sees parallax), on an equal-area map. A single value is a sphere. An empty
// map stands for the paper's proxy, the light-field plane itself. Of a room or a mesh the map is a picture, for those
// who read the file; rays meet the shape itself.
struct Surroundings {
  Eigen::Vector3f centre_in_world = Eigen::Vector3f::Zero();
  ImageF inverse_distance;  // one channel; Lambert's equal-area map (equal_area_square)
  std::optional<RoomBox> box;
  std::shared_ptr<const RayScene> mesh;  // shared: copies of a field look at the same triangles. Not in the file
  std::string mesh_file;                 // its name, without folders; in the file
  ImageF confidence;  // same size, 0…1: how clearly the distance was found; empty for a given sphere

  // Colour of the surroundings as seen from the centre, finer than the field's directions can hold: RGB + weight, the
  // upper half of a lat-long map (row 0 at the zenith, column 0 at azimuth 0, counter-clockwise); empty when there is
  // none.
  ImageF panorama;

  [[nodiscard]] bool is_plane() const { return inverse_distance.empty(); }

  // 1 / distance from p to where the ray from p towards `direction` (world, unit) meets the surface; 0 when distant.
  // The nearest crossing beyond 0.2 m counts (of a mesh: beyond 2 cm, either side of a triangle; a ray that meets none
  // is distant). Precondition: not the plane; p is nearer to the centre than the surface is.
  [[nodiscard]] float inverse_distance_along(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const;

  // Inverse distance from the centre; bilinear. A direction below the horizon takes the horizon's value.
  [[nodiscard]] float inverse_distance_of(const Eigen::Vector3f& direction) const;

  // Colour and weight of the panorama, bilinear; weight 0 where nothing was seen. Precondition: there is a panorama.
  [[nodiscard]] Eigen::Vector4f panorama_at(const Eigen::Vector3f& direction) const;
};

// A sphere; infinity is allowed.
[[nodiscard]] Surroundings sphere_surroundings(const Eigen::Vector3f& centre_in_world, double radius_m);

// A room. The map has 256² cells, half a degree each.
[[nodiscard]] Surroundings box_surroundings(const Eigen::Vector3f& centre_in_world, const RoomBox&);

// Triangles in world coordinates. The map has 512² cells, a quarter of a degree each; a file's reader so sees what the
// centre sees. `mesh_file` only names them.
[[nodiscard]] Surroundings mesh_surroundings(const Eigen::Vector3f& centre_in_world, std::shared_ptr<const RayScene>,
                                             std::string mesh_file);

// "plane", "sphere:1.4", "sphere:inf", "box:-2,-1.5,3,1.5,2.4", "mesh:room.obj", or "depth" for a map.
[[nodiscard]] std::string surroundings_name(const Surroundings&);

// The radius in "sphere:2.5" or "sphere:inf". Nothing for anything else or a radius that is not positive.
[[nodiscard]] std::optional<double> parse_sphere(std::string_view);

// Lambert's equal-area map of the upper hemisphere into the square [0, 1]²: the zenith at its middle, the horizon on
// the inscribed circle, x to the right and y down as in a picture. equal_area_direction is its inverse (corners: the
// horizon).
[[nodiscard]] Eigen::Vector2f equal_area_square(const Eigen::Vector3f& direction);
[[nodiscard]] Eigen::Vector3f equal_area_direction(const Eigen::Vector2f& position);

}  // namespace mf
