// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

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
// What hides it lies at `share` of the way from the plane to the emitter, a share of its own for each line from the
// emitter's centre to a point m of the plane. A ray from p to a point y of the emitter passes the occluder at
// q = p + share · (y − p), which is on the line to m = e + (q − e) (h − e_z)/(q_z − e_z): there the mask says how much
// light passes.
struct ShadedEmitter {
  // Of the radius: a view's ray that passes the centre no farther off sees nothing but the emitter. Pixels at the rim
  // show half of what is beside it.
  static constexpr float well_inside = 0.7F;

  Emitter emitter;
  Eigen::Vector3f radiance = Eigen::Vector3f::Zero();  // where nothing hides it
  float occluder_share = 1;                            // 0 to 1: the share where the mask knows none
  float plane_height_m = 0;                            // h: world z of the plane
  Eigen::Vector2f mask_min_m = Eigen::Vector2f::Zero();
  Eigen::Vector2f mask_max_m = Eigen::Vector2f::Zero();
  // Three channels: the part of the light that passes (0…1), its weight (up to 1e-4: no view looked there, a guess),
  // the share. Row 0 at max y.
  ImageF mask;

  // Distance from the origin to the ray's point nearest to the centre; nothing when it passes outside `scale` radii.
  [[nodiscard]] std::optional<float> met_at(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                            float scale = 1) const;

  // Share of the emitter's light that a ray from the plane's point p (world) receives; nothing without a mask, or when
  // no view looked at the emitter at all.
  // Precondition: the ray meets the emitter.
  [[nodiscard]] std::optional<float> visibility(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const;

  // The share for the ray from the plane's point p (world) to the emitter; precondition as above.
  [[nodiscard]] float share_along(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const;

  // The occluder's point on the line to mask position m (world x, y).
  [[nodiscard]] Eigen::Vector3f occluder_point(const Eigen::Vector2f& m, float share) const;

 private:
  struct Passage {
    float share;
    Eigen::Vector2f texel;  // of the mask
  };
  // Where the ray passes the occluder. Precondition: there is a mask.
  [[nodiscard]] Passage passage(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const;
  // Where the ray passes an occluder at `share`, as a position in texels of the mask (centres at +0.5), inside it.
  [[nodiscard]] Eigen::Vector2f mask_texel(const Eigen::Vector3f& p, const Eigen::Vector3f& direction,
                                           float share) const;
};

// The emitter that a ray meets, hidden or not; null when it meets none.
[[nodiscard]] const ShadedEmitter* emitter_met(std::span<const ShadedEmitter>, const Eigen::Vector3f& origin,
                                               const Eigen::Vector3f& direction);

// Whether rays from p within `angle_rad` of the direction may meet one.
[[nodiscard]] bool may_meet_emitter(std::span<const ShadedEmitter>, const Eigen::Vector3f& p,
                                    const Eigen::Vector3f& direction, float angle_rad);

}  // namespace mf
