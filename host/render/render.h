// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "common/image.h"
#include "common/progress.h"
#include "host/io/view.h"
#include "host/render/ground.h"
#include "host/render/illuminator.h"
#include "host/render/incident_light.h"

namespace mf {

struct RenderOptions {
  Backend backend = Backend::automatic;

  // Directions in which the object sees the light that the ground sends up; more softens the pattern of a textured
  // ground on the object. 16 to 100000.
  int ground_directions = 800;

  // Directions in which light is followed once from the object to itself and to the ground; 0: not at all, else 16 to
  // 100000.
  int bounce_directions = 500;

  [[nodiscard]] std::optional<std::string> validate() const;
};

struct RenderInput {
  const IncidentLight& light;
  const TriangleMesh& mesh_in_world;  // may be empty: the bare ground
  const View& view;
  // What the ground sends up without the object, in the plane frame; nothing: a black ground, of which no picture is
  // made. Precondition: with a ground, light that was asked for with the plane.
  std::optional<GroundRadiance> ground;
};

// Linear pictures of the view's size.
struct RenderResult {
  ImageF object;          // red, green, blue (radiance, times coverage) and coverage
  ImageF ground_without;  // irradiance of the plane at each pixel, three channels; 0 where the pixel sees no ground
  ImageF ground_with;     // the same with the object there: its shadow, and the light that it reflects
  std::string backend;    // which one did it
  std::size_t lights = 0;
  std::size_t fragments = 0;
};

// The object in the captured light (diffuse), and what its presence does to the plane.
//
//   B(x) = albedo / π · Σ_i L(p_i(x), ω_i) max(0, n·ω_i) ΔΩ_i V(x, ω_i)          Ihrke et al. 2008, §4.4
//
// over the upper hemisphere (the light field) and the lower (the ground, shadowed by the object), plus one bounce off
// the object. The mesh is moved into the plane frame; everything happens there. Visibility is the back end's; the
// bounce, which varies slowly, is always traced on the CPU. Throws as Illuminator.
[[nodiscard]] RenderResult render(const RenderInput&, const RenderOptions&, const Progress& = {});

// A ground of one albedo around the object, lit by the captured light alone. Precondition: it was asked for with the
// plane.
[[nodiscard]] GroundRadiance diffuse_ground(const IncidentLight&, const TriangleMesh& mesh_in_world, double albedo);

}  // namespace mf
