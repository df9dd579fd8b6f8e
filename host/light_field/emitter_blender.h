// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "host/light_field/emitters.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/view_rays.h"
#include "host/team/team.h"

namespace mf {

// In how many parts a cell beside an emitter is looked at: 6 · 2ⁿ with this n, so that each is smaller than the lamps
// that matter, however large the cells: a lamp's energy then does not depend on the number of directions.
[[nodiscard]] int splits_near_emitter(float cell_solid_angle_sr);

// Rays at and about small bright sources, blended with care for what else is known there.
//
// A lamp is thousands of times brighter than what surrounds it, and its edge and the leaves before it lie at different
// distances: no single focus is right. But a ray either meets the lamp's ball or not, and that is known:
//  - a ray that meets it is focused on the occluder: of all views' rays through that point of the occluder, those that
//    meet the ball too say whether it is hidden there (the lamp itself looks the same from everywhere). Together they
//    draw the occluder's mask, which answers;
//  - a ray that misses it is focused on the surroundings, and views that show the ball there have no say.
// So the lamp's outline is sharp where geometry puts it, its shadows' edges are where the occluder puts them, and no
// ghost of the lamp beside it adds energy.
class EmitterBlender {
 public:
  // Finds each emitter's occluder by photo-consistency over its distance, and draws its mask over the rectangle. Keeps
  // references to views and surroundings.
  EmitterBlender(const std::vector<FieldView>& views, const Surroundings&, std::span<const Emitter>,
                 const PlaneRectangle&, const Team&);
  // With masks that are drawn already. `Lit::no`: rays that meet an emitter are black, hidden or not.
  enum class Lit { no, yes };
  EmitterBlender(const std::vector<FieldView>& views, const Surroundings&, std::vector<ShadedEmitter>, Lit);

  // 1 + the index of an emitter that rays within `angle_rad` of the direction may see, or a ghost of it; 0: none.
  [[nodiscard]] std::uint32_t concerned(const Eigen::Vector3f& p, const Eigen::Vector3f& direction,
                                        float angle_rad) const;
  [[nodiscard]] bool concerns(const Eigen::Vector3f& p, const Eigen::Vector3f& direction, float angle_rad) const {
    return concerned(p, direction, angle_rad) != 0;
  }

  // Whether what a view shows of the proxy point, over `angle_rad` as seen from the plane, has an emitter or its glare
  // in it. For a ray that meets none such a view says nothing.
  [[nodiscard]] bool shown_by(const FieldView&, const ProxyPoint&, float angle_rad) const;

  // Blended colour and weight of one ray with a footprint of `angle_rad`. `met`: the emitter that it meets
  // (emitter_met). Only `candidates` are asked (indices of views).
  [[nodiscard]] Eigen::Vector4f radiance(const ShadedEmitter* met, const Eigen::Vector3f& p,
                                         const Eigen::Vector3f& direction, float angle_rad,
                                         std::span<const std::uint32_t> candidates) const;

  [[nodiscard]] const std::vector<ShadedEmitter>& emitters() const { return emitters_; }

 private:
  const std::vector<FieldView>& views_;
  const Surroundings& surroundings_;
  std::vector<ShadedEmitter> emitters_;
  Lit lit_ = Lit::yes;
};

}  // namespace mf
