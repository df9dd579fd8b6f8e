// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "common/image.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/surroundings.h"
#include "host/light_field/view_rays.h"

namespace mf {

// How much of a proxy's points views can see past the proxy itself (Buehler et al. 2001, §4.4): a pillar before a wall
// hides from some views what a wanted ray meets beside it. Each view keeps, for every few of its pixels, how far its
// ray goes from the light-field plane until it meets the proxy, as a shadow map does. Positions in the world, metres.
class ProxyVisibility {
 public:
  // Keeps a reference to the views.
  ProxyVisibility(const std::vector<FieldView>&, const Surroundings&, const PlaneRectangle&);

  // Whether it hides anything from anyone: inside of a sphere or a box, and on the plane, nothing is hidden.
  [[nodiscard]] bool hides_itself() const { return !met_.empty(); }

  // How much of X view number `view` sees: 1 all, 0 none, softly between. What its ray meets by a tenth nearer than X,
  // in inverse distance from the plane, and by 0.1/m, begins to hide it.
  [[nodiscard]] float of_view(std::size_t view, const ProxyPoint& x) const;

 private:
  const std::vector<FieldView>& views_;
  float plane_height_m_;            // world z
  std::vector<ImageF> met_;         // by view: inverse distance from the plane, 1/m; empty when nothing is hidden
  std::vector<float> nearest_met_;  // by view: the largest of these
};

}  // namespace mf
