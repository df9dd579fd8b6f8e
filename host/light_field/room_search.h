// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "host/light_field/distance_sweep.h"
#include "host/light_field/room_box.h"

namespace mf {

// The room on whose sides the views agree best: over all boxes the least mean cost of the sweep, each direction at the
// distance at which it meets the box, all solid angles alike. Sides are tried at evenly spaced inverse distances from
// the sweep's centre, infinity among them: one side after the other until none moves, from several cubes to begin with.
// A room that is no box, or whose walls are not along the world's axes, gives the box that serves best.
[[nodiscard]] RoomBox fit_room(const DistanceSweep&);

}  // namespace mf
