// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/image.h"

namespace mf {

// A small bright source that several views saw from different places: a lamp. World frame.
struct Emitter {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  float radius_m = 0;  // of a ball of the solid angle under which it appears
  int views = 0;       // that agree on it
};

// An emitter, and what hides parts of it from parts of the plane: leaves, a lampshade, a hand-rail.
//
// What hides it is taken to lie at one distance: at `occluder_share` of the way from the plane to the emitter. A ray
// from p to a point y of the emitter passes the occluder at q = p + share · (y − p). `mask` holds how much light passes
// there; it is laid out on the plane, q standing where the emitter's centre casts its shadow: m = e + (q − e) (h −
// e_z)/(q_z − e_z).
struct ShadedEmitter {
  Emitter emitter;
  Eigen::Vector3f radiance = Eigen::Vector3f::Zero();  // where nothing hides it
  float occluder_share = 1;                            // 0 to 1
  float plane_height_m = 0;                            // h: world z of the plane
  Eigen::Vector2f mask_min_m = Eigen::Vector2f::Zero();
  Eigen::Vector2f mask_max_m = Eigen::Vector2f::Zero();
  ImageF mask;  // two channels: the share of light that passes (0…1), and its weight (0: no view looked there); row 0
                // at max y

  // Distance from the origin to the ray's point nearest to the centre; nothing when it passes outside `scale` radii.
  [[nodiscard]] std::optional<float> met_at(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                            float scale = 1) const;

  // Share of the emitter's light that a ray from the plane's point p (world) receives; nothing where no view looked.
  // Precondition: the ray meets the emitter.
  [[nodiscard]] std::optional<float> visibility(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const;

  // The occluder's point that stands at mask position m (world x, y).
  [[nodiscard]] Eigen::Vector3f occluder_point(const Eigen::Vector2f& m) const;
};

}  // namespace mf
