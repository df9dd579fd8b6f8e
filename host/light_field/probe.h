// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>

#include "common/image.h"
#include "host/light_field/light_field.h"

namespace mf {

// The ray of the field that stands for a ray in the world.
struct FieldRay {
  Eigen::Vector2f p_in_plane;  // where it crosses the plane, inside the rectangle
  Eigen::Vector3f direction;   // plane frame, unit
};

// Looks a light field up along any ray. Keeps references: the field outlives it.
class FieldSampler {
 public:
  explicit FieldSampler(const LightField&);

  // Parallax: the ray from x towards `direction` (world, unit) is followed to the point p where it crosses the plane.
  // When that lies outside the rectangle, the ray is replaced by the one from the rectangle's nearest point to where it
  // meets the surroundings. Nothing for rays that come from below the plane.
  [[nodiscard]] std::optional<FieldRay> field_ray(const Eigen::Vector3d& x_in_world,
                                                  const Eigen::Vector3d& direction) const;

  // Radiance and confidence, interpolated between the three nearest directions.
  [[nodiscard]] Eigen::Vector4f radiance(const FieldRay&) const;

  // The direction in which the surroundings' centre sees what the ray meets; world frame. Precondition: not the plane
  // proxy.
  [[nodiscard]] Eigen::Vector3f seen_from_centre(const FieldRay&) const;

  [[nodiscard]] const DirectionLocator& locator() const { return locator_; }

 private:
  const LightField& field_;
  DirectionLocator locator_;
  Rigid3 plane_from_world_;
};

// Whose lat-long convention a probe follows. World directions are Z-up; for the Y-up consumers world (x, y, z) becomes
// (x, z, −y). What is at the picture's centre / a quarter to the left / at the top, in the consumer's axes:
enum class LatLongConvention {
  openexr,  // +Z, +X, +Y; the first and last pixel's centres lie at ±π (OpenEXR, USD dome light, Mitsuba 3)
  blender,  // world +Y, −X, +Z; pixel edges span the sphere (a Blender panorama camera that faces +Y)
  threejs,  // +X, −Z, +Y; pixel edges span the sphere
};
[[nodiscard]] std::optional<LatLongConvention> parse_lat_long_convention(std::string_view name);

// World direction of a lat-long picture's pixel (centre), unit length.
[[nodiscard]] Eigen::Vector3d lat_long_direction(LatLongConvention, int width, int height, int x, int y);

// The solid angle that the pixel stands for, steradians.
[[nodiscard]] double lat_long_solid_angle(LatLongConvention, int width, int height, int x, int y);

struct Probe {
  ImageF radiance;    // RGB, width × width/2
  ImageF confidence;  // one channel, 0…1
};
// The light at one point as a lat-long picture. The field gives each cell's light at that point; within a cell the
// picture follows the surroundings' panorama (the field has some 3° between directions, the panorama a third of a
// degree), scaled so that the cell keeps its mean. Confidence is 0 where no view looked (colour is then the field's
// guess, or zero) and below the plane. Precondition: width even, ≥ 4.
[[nodiscard]] Probe make_probe(const LightField&, const Eigen::Vector3d& at_in_world, LatLongConvention, int width);

}  // namespace mf
