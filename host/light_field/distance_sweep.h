// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "common/image.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/view_rays.h"
#include "host/team/team.h"

namespace mf {

// How badly the views agree on what lies at each distance in each direction from the rectangle's centre: a plane sweep
// over inverse distance (Collins 1996) in which all views that see a point vote.
//
// The cost is the robust spread of their absolute log2 radiance, stops: the capture is radiometrically calibrated, so
// nothing is normalized. A view that an occluder or a gloss deceives counts once, not by how far off it is. The votes
// of neighbouring directions are pooled, each for as much as it tells: many more views see a near point than a far one,
// and a distance must not win by that. What no view tells of counts as a moderate disagreement: better than a distance
// at which many disagree, worse than one at which they agree.
struct DistanceSweep {
  Eigen::Vector3f centre_in_world = Eigen::Vector3f::Zero();
  float level_step = 0;  // 1/metres: level i lies at the inverse distance i · level_step
  // By level; equal-area map of directions, one channel.
  std::vector<ImageF> cost;

  [[nodiscard]] int side() const { return cost.front().width; }
  [[nodiscard]] int levels() const { return static_cast<int>(cost.size()); }
  // World direction of a cell's middle.
  [[nodiscard]] Eigen::Vector3f direction(int x, int y) const;
  // Between levels linear; beyond the nearest that level's.
  [[nodiscard]] float cost_at(int x, int y, float inverse_distance) const;
};

// A team shares the work.
[[nodiscard]] DistanceSweep sweep_surroundings(const std::vector<FieldView>& views, const PlaneRectangle&,
                                               const Team& = {});

// log2 luminance of what a view shows of the proxy point, over about `angle_rad`; nothing when it does not see it well
// inside of its border.
[[nodiscard]] std::optional<float> log_luminance(const FieldView&, const ProxyPoint&, float angle_rad);

// Mean distance from the median, each at most `limit`: what a view behind an occluder says counts once, not fully.
// Reorders `values`; precondition: there are some.
[[nodiscard]] double robust_spread(std::vector<float>& values, float limit);

// World position of the rectangle's centre.
[[nodiscard]] Eigen::Vector3f centre_of(const PlaneRectangle& rectangle);

}  // namespace mf
