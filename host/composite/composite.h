// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "host/render/render.h"

namespace mf {

struct CompositeOptions {
  RenderOptions render;

  [[nodiscard]] std::optional<std::string> validate() const { return render.validate(); }
};

struct CompositeResult {
  ImageF picture;       // red, green, blue, linear, the plate's size
  RenderResult layers;  // what it was made of
  double changed = 0;   // share of the plate's pixels that the object changes by more than 1 %
};

// A virtual object in a picture of the real place, by differential rendering (Debevec 1998, §6):
//
//   picture = object + (1 − coverage) · plate · E_with / E_without
//
// The plate is linear and its camera known; the receiving plane is the light field's (the table). Its irradiance with
// and without the object comes from the captured light, so their ratio holds shadows and reflected light, and the plate
// keeps its own texture. The light that the plane sends up onto the object is the plate itself, seen on the plane.
// Preconditions: the light was asked for with the plane; three channels, the view's size, every value finite.
[[nodiscard]] CompositeResult composite(const IncidentLight&, const TriangleMesh& mesh_in_world, const ImageF& plate,
                                        const View&, const CompositeOptions&, const Progress& = {});

// The plate as the radiance of the plane around the object. Where the camera doesn't see the plane, the radiance is
// that of the nearest parts that it sees, ever more blurred with the distance (push–pull, Gortler et al. 1996, §3.4).
[[nodiscard]] GroundRadiance plate_on_ground(const ImageF& plate, const View&, const PlaneRectangle&,
                                             const Bounds& object_in_plane);

}  // namespace mf
