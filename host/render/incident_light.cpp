// SPDX-License-Identifier: Apache-2.0
#include "host/render/incident_light.h"

#include <algorithm>

#include "common/check.h"

namespace mf {

namespace {

constexpr int bounce_directions = 320;  // of the light that reaches the object before the bounce

std::vector<PlaneImage> images(std::span<const PlaneTile> tiles) {
  std::vector<PlaneImage> result;
  for (const PlaneTile& tile : tiles) result.push_back(tile.image());
  return result;
}

std::vector<double> light_in(const LightField& field, const Bounds& object_in_plane) {
  if (!field.surroundings.panorama.empty()) return light_on(field, object_in_plane);
  return light_of_tiles(field.directions, images_of(field));
}

IncidentLight assemble(const DirectionSet& set, const PlaneRectangle& rectangle, const LightPlan& plan,
                       std::vector<PlaneImage> of_groups, std::vector<PlaneImage> of_bounce,
                       const LightOptions& options) {
  const bool same = plan.bounce_groups.empty();
  IncidentLight light;
  light.plane = rectangle;
  light.for_bounce = make_light_set(set, same ? plan.groups : plan.bounce_groups, same ? of_groups : of_bounce, {0, 1});
  light.from_above = make_light_set(set, plan.groups, std::move(of_groups), options.importance);
  if (options.plane) light.bare = bare_irradiance(light.from_above);
  return light;
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
    for (TileRequest& request :
         options.plane ? tiles_for_plane(*groups, rectangle) : tiles_for_object(set, *groups, object_in_plane))
      plan.requests.push_back(std::move(request));
  return plan;
}

IncidentLight incident_light(const DirectionSet& set, const PlaneRectangle& rectangle, const LightPlan& plan,
                             std::vector<PlaneTile> tiles, const LightOptions& options) {
  check(tiles.size() == plan.requests.size(), "a tile for each request");
  std::vector<PlaneImage> of_groups = images(tiles);
  std::vector<PlaneImage> of_bounce(of_groups.begin() + static_cast<std::ptrdiff_t>(plan.groups.size()),
                                    of_groups.end());
  of_groups.resize(plan.groups.size());
  IncidentLight light = assemble(set, rectangle, plan, std::move(of_groups), std::move(of_bounce), options);
  light.tiles = std::move(tiles);
  return light;
}

IncidentLight incident_light(const LightField& field, const Bounds& object_in_plane, const LightOptions& options) {
  const std::vector<double> brought = light_in(field, object_in_plane);
  const LightPlan plan = plan_light(field.directions, brought, object_in_plane, field.plane, options);
  if (options.directions > 0)
    return incident_light(field.directions, field.plane, plan, merged_tiles(field, plan.requests), options);
  // Every cell by itself: no tile needs to be copied but for the bounce.
  std::vector<PlaneTile> merged = merged_tiles(field, std::span(plan.requests).subspan(plan.groups.size()));
  IncidentLight light = assemble(field.directions, field.plane, plan, images_of(field), images(merged), options);
  light.tiles = std::move(merged);
  return light;
}

}  // namespace mf
