// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/light_field/emitter_light.h"
#include "host/light_field/light_tiles.h"
#include "host/render/emitter_lights.h"
#include "host/render/importance.h"
#include "host/render/light_set.h"

namespace mf {

// The light that one picture is made with, by value: of a light field or of a capture, the renderer does not know.
//
// Both are asked in the same two steps: plan_light says which cells of the hemisphere are taken together and where on
// the plane they are needed, somebody makes the tiles (merged_tiles, resample_just_in_time), and incident_light puts
// them together with the emitters, which are lights at their place.
struct IncidentLight {
  IncidentLight() = default;
  IncidentLight(IncidentLight&&) = default;  // no copies: the sets refer to the tiles
  IncidentLight& operator=(IncidentLight&&) = default;

  PlaneRectangle plane;
  DarkTiles dark;  // a field's tiles, when its cells are taken one by one
  std::vector<PlaneTile> tiles;
  EmitterLights emitters, emitters_for_bounce;
  LightSet from_above;
  LightSet for_bounce;  // of few directions: for what varies slowly
  PlaneTile bare;       // irradiance of the plane without the object and the emitters; empty when only the object is
                        // asked for

  // Irradiance of the plane without the object. Precondition: the plane was asked for.
  [[nodiscard]] Eigen::Vector3f on_bare_plane(const Eigen::Vector2f& p) const {
    return sample(bare.image(), p).head<3>() + emitted_irradiance(from_above, p);
  }
};

struct LightOptions {
  // Into how many groups the hemisphere's cells are taken, the important parts finely; 0: every cell by itself.
  int directions = 0;
  ImportanceOptions importance;
  // What is needed of the plane's own irradiance: nothing, when only the object is lit; what it is where the object
  // changes it, beside a plate that shows the rest; or all of it, when the plane is in the picture.
  enum class Plane { none, near_object, all };
  Plane plane = Plane::all;

  [[nodiscard]] std::optional<std::string> validate() const;
};

struct LightPlan {
  std::vector<CellGroup> groups;
  std::vector<CellGroup> bounce_groups;  // empty: the bounce takes `groups`
  std::vector<TileRequest> requests;     // for the groups, then for the bounce's
};

// `light`: what each cell brings (light_on, light_of_tiles). The box is the object's, in the plane frame.
[[nodiscard]] LightPlan plan_light(const DirectionSet&, std::span<const double> light, const Bounds& object_in_plane,
                                   const PlaneRectangle&, const LightOptions&);

// Precondition: a tile for each of the plan's requests, without the emitters' light. The field needs no texels.
[[nodiscard]] IncidentLight incident_light(const LightField&, const Bounds& object_in_plane, const LightPlan&,
                                           std::vector<PlaneTile> tiles, const LightOptions&);

// All of it for a light field that is in memory. Without `directions` it refers to the field's texels, which must
// outlive it.
[[nodiscard]] IncidentLight incident_light(const LightField&, const Bounds& object_in_plane, const LightOptions&);

}  // namespace mf
