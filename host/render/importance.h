// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "host/io/mesh.h"
#include "host/light_field/light_field.h"
#include "host/light_field/light_tiles.h"

namespace mf {

// Cells that light a picture as one, in the plane frame.
//
// With P_i the light that cell i brings, the group keeps the light that its cells bring to any surface that sees them
// all, which is the vector Σ P_i ω_i (Gershun 1939): the direction is the vector's, and the solid angle
//
//   ΔΩ = Σ ΔΩ_i · |Σ P_i ω_i| / Σ P_i
//
// is that of the cells, less what the spread of their directions costs. For a single cell it is the cell's.
struct CellGroup {
  std::vector<std::uint32_t> cells;
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();
  float solid_angle_sr = 0;
  double light = 0;  // Σ P_i
};

// The light (luminance times solid angle, any unit) that each cell of a field brings to an object: from the panorama of
// the surroundings as seen from the object's middle. Emitters are lights of their own (emitter_lights.h). It needs no
// texel, so a field and the capture that it is made of say the same. Precondition: the surroundings have a panorama.
[[nodiscard]] std::vector<double> light_on(const LightField&, const Bounds& object_in_plane);

// The same from each cell's tile: its mean. Precondition: a tile for each direction.
[[nodiscard]] std::vector<double> light_of_tiles(const DirectionSet&, std::span<const PlaneImage>);

// The hemisphere in `count` groups, or as many as there are cells: starting with all cells in one, the group that
// brings most light over the widest angle (light · root mean square angle from its middle) is cut in two across its
// longest axis. So lamps get many groups and what is dim few. Precondition: count ≥ 1, a light for each cell.
[[nodiscard]] std::vector<CellGroup> group_cells(const DirectionSet&, std::span<const double> light, int count);

// Where the light of each group is looked up that lights, or is hidden by, something inside the object's box: the
// points p = x − ω x_z / ω_z, for a group's direction, and for a single cell for all that it holds.
[[nodiscard]] std::vector<TileRequest> tiles_for_object(const DirectionSet&, std::span<const CellGroup>,
                                                        const Bounds& object_in_plane);

// The same when the plane's own light is asked for: the whole rectangle.
[[nodiscard]] std::vector<TileRequest> tiles_for_plane(std::span<const CellGroup>, const PlaneRectangle&);

}  // namespace mf
