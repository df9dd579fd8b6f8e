// SPDX-License-Identifier: Apache-2.0
#include "host/render/incident_light.h"

#include <algorithm>

#include "common/check.h"

namespace mf {

namespace {

constexpr int bounce_directions = 320;  // of the light that reaches the object before the bounce
constexpr int bounce_emitter_points = 16;

std::vector<PlaneImage> images(std::span<const PlaneTile> tiles) {
  std::vector<PlaneImage> result;
  for (const PlaneTile& tile : tiles) result.push_back(tile.image());
  return result;
}

std::vector<double> light_in(const LightField& field, std::span<const PlaneImage> dark, const Bounds& object_in_plane) {
  if (!field.surroundings.panorama.empty()) return light_on(field, object_in_plane);
  return light_of_tiles(field.directions, dark);
}

// The object's box with the ground beneath it.
Bounds with_its_ground(const Bounds& object_in_plane) {
  Bounds box = object_in_plane;
  box.low.z() = std::min(box.low.z(), 0.F);
  return box;
}

// Near the object the plane's light counts beneath it and where its shadows fall. A preview asks for no more; beside
// that what each direction's tile has at its rim holds on.
std::vector<TileRequest> tiles_for(const DirectionSet& set, std::span<const CellGroup> groups,
                                   const Bounds& object_in_plane, const PlaneRectangle& rectangle,
                                   const LightOptions& options) {
  using Plane = LightOptions::Plane;
  if (options.plane == Plane::none) return tiles_for_object(set, groups, object_in_plane);
  if (options.plane == Plane::near_object && options.directions > 0)
    return tiles_for_object(set, groups, with_its_ground(object_in_plane));
  return tiles_for_plane(groups, rectangle);
}

// How many points each emitter gets: in a preview a share of the picture's directions.
int points_of_emitters(const LightOptions& options) {
  constexpr int share = 4, fewest = 16;
  const int most = options.importance.emitter_points;
  return options.directions == 0 ? most : std::min(most, std::max(fewest, options.directions / share));
}

void assemble(const LightField& field, const Bounds& object_in_plane, const LightPlan& plan,
              std::vector<PlaneImage> of_groups, std::vector<PlaneImage> of_bounce, const LightOptions& options,
              IncidentLight& light) {
  const bool same = plan.bounce_groups.empty();
  const DirectionSet& set = field.directions;
  light.plane = field.plane;
  light.for_bounce = make_light_set(set, same ? plan.groups : plan.bounce_groups, same ? of_groups : of_bounce, {0, 1});
  light.from_above = make_light_set(set, plan.groups, std::move(of_groups), options.importance);
  const bool plane = options.plane != LightOptions::Plane::none;
  if (plane) light.bare = bare_irradiance(light.from_above);
  const int points = points_of_emitters(options);
  light.emitters = emitter_lights(field, object_in_plane, plane, points);
  light.emitters_for_bounce = emitter_lights(field, object_in_plane, plane, std::min(points, bounce_emitter_points));
  append_emitters(light.from_above, light.emitters);
  append_emitters(light.for_bounce, light.emitters_for_bounce);
}

}  // namespace

std::optional<std::string> LightOptions::validate() const {
  if (directions < 0 || directions > 500000) return "directions must lie between 1 and 500000";
  return importance.validate();
}

LightPlan plan_light(const DirectionSet& set, std::span<const double> light, const Bounds& object_in_plane,
                     const PlaneRectangle& rectangle, const LightOptions& options) {
  const int cells = static_cast<int>(set.size());
  LightPlan plan;
  plan.groups = group_cells(set, light, options.directions > 0 ? options.directions : cells);
  if (plan.groups.size() > bounce_directions) plan.bounce_groups = group_cells(set, light, bounce_directions);
  for (const std::vector<CellGroup>* groups : {&plan.groups, &plan.bounce_groups})
    for (TileRequest& request : tiles_for(set, *groups, object_in_plane, rectangle, options))
      plan.requests.push_back(std::move(request));
  return plan;
}

IncidentLight incident_light(const LightField& field, const Bounds& object_in_plane, const LightPlan& plan,
                             std::vector<PlaneTile> tiles, const LightOptions& options) {
  check(tiles.size() == plan.requests.size(), "a tile for each request");
  std::vector<PlaneImage> of_groups = images(tiles);
  std::vector<PlaneImage> of_bounce(of_groups.begin() + static_cast<std::ptrdiff_t>(plan.groups.size()),
                                    of_groups.end());
  of_groups.resize(plan.groups.size());
  IncidentLight light;
  light.tiles = std::move(tiles);
  assemble(field, object_in_plane, plan, std::move(of_groups), std::move(of_bounce), options, light);
  return light;
}

IncidentLight incident_light(const LightField& field, const Bounds& object_in_plane, const LightOptions& options) {
  DarkTiles dark = tiles_without_emitters(field);
  const std::vector<double> brought = light_in(field, dark.images, object_in_plane);
  const LightPlan plan = plan_light(field.directions, brought, object_in_plane, field.plane, options);
  if (options.directions > 0)
    return incident_light(field, object_in_plane, plan, merged_tiles(field.directions, dark.images, plan.requests),
                          options);
  // Every cell by itself: no tile needs to be copied but for the bounce.
  IncidentLight light;
  light.tiles = merged_tiles(field.directions, dark.images, std::span(plan.requests).subspan(plan.groups.size()));
  std::vector<PlaneImage> of_groups = dark.images;
  light.dark = std::move(dark);
  assemble(field, object_in_plane, plan, std::move(of_groups), images(light.tiles), options, light);
  return light;
}

}  // namespace mf
