// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/light_field/light_field.h"
#include "host/light_field/light_tiles.h"
#include "host/render/importance.h"

namespace mf {

// Parallel light: at x it brings the radiance image(p) from `direction` (unit length, towards the light), where p is
// the point in which the line through x along the direction crosses the plane:
//
//   p = x − ω x_z / ω_z
//
// An upward ω is a direction of the light field, a downward one is what the plane itself sends up.
struct DirectionalLight {
  Eigen::Vector3f direction;
  float solid_angle_sr = 0;
  std::uint32_t image = 0;
};

// A point of an emitter's face, and the share of the emitter's light that it sends. At x it brings the radiance
// image(p) from its own direction ω, under that share of the solid angle under which x sees the emitter's ball; p is
// again where the line through x crosses the plane. What lies no lower than the point itself it does not light.
struct EmitterPoint {
  Eigen::Vector3f position;
  Eigen::Vector3f centre;  // of the emitter
  float radius_m = 0;      // of the emitter
  float share = 0;
  std::uint32_t image = 0;

  [[nodiscard]] float solid_angle_from(const Eigen::Vector3f& x) const {
    const float sine = std::min(1.F, radius_m / std::max((centre - x).norm(), 1e-12F));
    // 2π (1 − cos), without the difference of nearly equal numbers
    return share * 2 * std::numbers::pi_v<float> * sine * sine / (1 + std::sqrt(1 - sine * sine));
  }
};

struct LightSet {
  std::vector<PlaneImage> images;
  std::vector<DirectionalLight> lights;
  std::vector<EmitterPoint> emitter_points;
};

struct ImportanceOptions {
  // A direction of the light field stands for its cell. A bright cell (a lamp) is lit from several points of the cell
  // so that its shadows are as soft as the cell is wide; the cells share this many points by the light they bring. 0:
  // one shadow a direction. More costs time in proportion; 0 to 100000.
  int extra_directions = 700;
  // The most points that one cell gets; 1 to 1024. Beyond 64 no eye sees a step between the shadows.
  int most_per_cell = 96;
  // Points of each emitter's face, each with a shadow of its own; 1 to 1024. Beyond 64 no eye sees a step between them.
  int emitter_points = 64;

  [[nodiscard]] std::optional<std::string> validate() const;
};

// Groups of cells as parallel lights, each with its image; groups of one bright cell are refined. Both back ends sum
// over this same set. It refers to the images' texels, which must outlive it. Energy is kept: the solid angles of a
// cell's points sum to the cell's. Precondition: an image for each group.
[[nodiscard]] LightSet make_light_set(const DirectionSet&, std::span<const CellGroup>, std::vector<PlaneImage> images,
                                      const ImportanceOptions&);

// A whole light field, every cell a group, by the light that its tiles hold.
[[nodiscard]] LightSet make_light_set(const LightField&, const ImportanceOptions&);

// Irradiance of the bare plane under the set's parallel lights, over all of their images, as finely as they are but
// with at most 64 texels a side, or as many as one of them has: E(p) = Σ image(p) ω_z ΔΩ. An empty set has none.
[[nodiscard]] PlaneTile bare_irradiance(const LightSet&);

// That of its emitters' points, at one point of the plane.
[[nodiscard]] Eigen::Vector3f emitted_irradiance(const LightSet&, const Eigen::Vector2f& p);

// What a plane sends up, as parallel lights from below: `count` directions over the lower hemisphere, one image.
void append_ground_light(LightSet&, const PlaneImage& outgoing_radiance, int count);

}  // namespace mf
