// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "common/image.h"
#include "common/rigid3.h"
#include "host/light_field/direction_set.h"
#include "host/light_field/shaded_emitter.h"
#include "host/light_field/surroundings.h"

namespace mf {

// A rectangle of the light-field plane. Plane frame: x and y in the plane, z its normal, metres.
struct PlaneRectangle {
  Rigid3 world_from_plane;
  Eigen::Vector2d min_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d max_m = Eigen::Vector2d::Zero();

  [[nodiscard]] Eigen::Vector2d size_m() const { return max_m - min_m; }
};

// The light that arrives at a plane: L(p, ω), linear radiance in BT.709 primaries, ω pointing from p to the light.
//
// For every direction a tile of resolution² texels over the rectangle; texel (0, 0) is at (min x, max y): a tile seen
// in a viewer has +x right and +y up. `rgbc` holds half-float-exact values as float: red, green, blue, confidence; by
// direction, then row, column. Confidence is 1 where views answered fully, 0 where no view looked: colour is then a
// guess (see hole_filler.h), or 0 where none was made. Each direction stands for its cell: its value is the mean
// radiance over that solid angle.
struct LightField {
  PlaneRectangle plane;
  DirectionSet directions;
  Surroundings surroundings;            // on which the views were focused
  std::vector<ShadedEmitter> emitters;  // small bright sources among them; their light is in the tiles too
  int resolution = 0;
  bool absolute = false;     // radiance is in the units of the reference reading
  std::string options_json;  // the options that made it
  std::vector<Eigen::Vector4f> rgbc;

  [[nodiscard]] std::size_t texel_count() const {
    return static_cast<std::size_t>(resolution) * static_cast<std::size_t>(resolution);
  }
  [[nodiscard]] const Eigen::Vector4f* tile(std::size_t direction) const {
    return rgbc.data() + direction * texel_count();
  }
  [[nodiscard]] Eigen::Vector4f* tile(std::size_t direction) { return rgbc.data() + direction * texel_count(); }
};

// A texel's say when texels are mixed: its confidence. A guess speaks only where nothing else does.
[[nodiscard]] inline float say_of(const Eigen::Vector4f& texel) {
  constexpr float of_a_guess = 1e-4F;  // below any confidence that a half float of a view's weight can have left
  return texel.w() > 0 ? texel.w() : (texel.head<3>().array() != 0).any() ? of_a_guess : 0.0F;
}

// Bilinear in p (plane coordinates, metres) within one direction's tile; p outside the rectangle is clamped to it.
// Returns red, green, blue weighted by say_of(), and the confidence (0: a guess, or nothing).
[[nodiscard]] Eigen::Vector4f sample_tile(const LightField&, std::size_t direction, const Eigen::Vector2f& p_in_plane);

// Irradiance of the bare plane at each texel of a tile, three channels: E(p) = Σ L(p, ω) ω_z ΔΩ.
[[nodiscard]] ImageF plane_irradiance(const LightField&);

// `*.lf.exr`: one tiled OpenEXR, one tile a direction, tiles in rows of ceil(√n); attributes as docs/light_field.md.
// Written aside and renamed. Both throw InputError naming the file (and the attribute).
void write_light_field(const std::filesystem::path&, const LightField&);
[[nodiscard]] LightField read_light_field(const std::filesystem::path&);

}  // namespace mf
