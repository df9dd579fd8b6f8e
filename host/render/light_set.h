// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image.h"
#include "host/light_field/light_field.h"

namespace mf {

// Radiance by position on the plane z = 0: cell-centred texels over a rectangle, row 0 at max y. Red, green, blue and
// one unused. Bilinear; beyond the rectangle the rim's value holds on. The texels belong to somebody else.
struct PlaneImage {
  Eigen::Vector2f min_m = Eigen::Vector2f::Zero();
  Eigen::Vector2f max_m = Eigen::Vector2f::Zero();
  int width = 0;
  int height = 0;
  const Eigen::Vector4f* texels = nullptr;
};

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

struct LightSet {
  std::vector<PlaneImage> images;
  std::vector<DirectionalLight> lights;
};

struct ImportanceOptions {
  // A direction of the light field stands for its cell. A bright cell (a lamp) is lit from several points of the cell
  // so that its shadows are as soft as the cell is wide; the cells share this many points by the light they bring. 0:
  // one shadow a direction. More costs time in proportion; 0 to 100000.
  int extra_directions = 700;
  // The most points that one cell gets; 1 to 1024. Beyond 64 no eye sees a step between the shadows.
  int most_per_cell = 96;

  [[nodiscard]] std::optional<std::string> validate() const;
};

// The light field as parallel lights, brightest cells refined. Both back ends sum over this same set. It refers to the
// texels of the field, which must outlive it. Energy is kept: the solid angles of a cell's points sum to the cell's.
[[nodiscard]] LightSet make_light_set(const LightField&, const ImportanceOptions&);

// The same light from about `directions` directions only: cells merged with their neighbours, energy kept, each merged
// cell in the direction that its light mostly comes from. For what varies slowly.
[[nodiscard]] LightField coarsened(const LightField&, int directions);

// What a plane sends up, as parallel lights from below: `count` directions over the lower hemisphere, one image.
void append_ground_light(LightSet&, const PlaneImage& outgoing_radiance, int count);

// Bilinear lookup; see PlaneImage.
[[nodiscard]] Eigen::Vector4f sample(const PlaneImage&, const Eigen::Vector2f& p);

}  // namespace mf
