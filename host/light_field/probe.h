// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>

#include "common/image.h"
#include "host/light_field/light_field.h"

namespace mf {

// Looks a light field up along any ray. Keeps references: the field outlives it.
class FieldSampler {
 public:
  explicit FieldSampler(const LightField&);

  // Radiance that arrives at x from `direction` (world frame, unit; from x towards the light) and its confidence.
  // Parallax: the ray is followed to the point p where it crosses the plane; between directions the three nearest are
  // interpolated. A ray that crosses outside the rectangle is replaced by the one from the rectangle's nearest point to
  // where the ray meets the proxy. Zero, with confidence 0, for rays that come from below the plane.
  [[nodiscard]] Eigen::Vector4f radiance(const Eigen::Vector3d& x_in_world, const Eigen::Vector3d& direction) const;

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

struct Probe {
  ImageF radiance;    // RGB, width × width/2
  ImageF confidence;  // one channel, 0…1
};
// The light at one point as a lat-long picture. Precondition: width even, ≥ 4.
[[nodiscard]] Probe make_probe(const LightField&, const Eigen::Vector3d& at_in_world, LatLongConvention, int width);

}  // namespace mf
