// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "host/blending/ray_penalty.h"
#include "host/light_field/emitter_blender.h"
#include "host/light_field/field_views.h"
#include "host/light_field/proxy_visibility.h"
#include "host/light_field/surroundings.h"
#include "host/light_field/view_rays.h"

namespace mf {

// A wanted ray: the light that arrives at p from `direction` (world, unit), averaged over about `angle_rad` (with the
// plane proxy, whose points lie at p itself, over as many metres).
struct WantedRay {
  Eigen::Vector3f p = Eigen::Vector3f::Zero();
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();
  float angle_rad = 0;
};

// A view that speaks for a ray.
struct SpeakingView {
  std::uint32_t view = 0;  // index among the views
  float weight = 0;        // the weights of a ray sum to 1
  RayTerms terms;          // why: see host/blending/ray_penalty.h; `angle` in metres, for the plane proxy in radians
  Eigen::Vector3f radiance = Eigen::Vector3f::Zero();  // what it shows
};

struct RayAnswer {
  Eigen::Vector3f radiance = Eigen::Vector3f::Zero();
  float confidence = 0;                // as in LightField
  std::vector<SpeakingView> speaking;  // heaviest first
};

// One ray that meets no emitter, blended from all views by ranking every one of them: what the tiles hold, without
// their shortcuts, and why.
struct AnswerOptions {
  PenaltyOptions penalty;
  const ProxyVisibility* visibility = nullptr;  // where given, views see X as far as the proxy does not hide it
  const EmitterBlender* emitters = nullptr;     // where given, views that show one of them there have no say
  std::optional<std::uint32_t> except;          // a view that does not take part (leave one out)
};
[[nodiscard]] RayAnswer answer_of(std::span<const FieldView>, const Surroundings&, const WantedRay&,
                                  const AnswerOptions&);

}  // namespace mf
