// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/light_field/emitters.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/surroundings_search.h"
#include "host/team/team.h"

namespace mf {

// What is wrong with a proxy's name, in words; nothing for auto, sphere, sphere:R, sphere:inf, box, box:X0,Y0,X1,Y1,H,
// mesh:FILE and plane.
[[nodiscard]] std::optional<std::string> proxy_fault(const std::string& proxy);

struct ProxyChoice {
  Surroundings surroundings;
  std::vector<SphereScore> sphere_scores;  // only when a sphere was chosen
};

// The surroundings that a proxy's name asks for; see docs/light_field.md, "Focus". Throws InputError: a mesh that
// cannot be read or that nothing on the plane can see, a box that does not hold the rectangle. A team shares the work.
// Precondition: no proxy_fault.
[[nodiscard]] ProxyChoice choose_proxy(const std::vector<FieldView>&, const PlaneRectangle&, const std::string& proxy,
                                       int k, std::span<const Emitter>, const Team&);

}  // namespace mf
