// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "common/image.h"
#include "common/mirror_target.h"
#include "host/calibration/calibration.h"
#include "host/light_field/light_field.h"

namespace mf {

// The rays that one frame caught: from the virtual centre through the mirror's opening. World frame.
struct CaughtRays {
  Eigen::Vector3d centre;
  std::array<Eigen::Vector3d, 4> opening;  // corners, in order

  // Of the caught ray whose line passes p, before the mirror or behind it: its direction, unit length, towards the
  // light (away from the centre). Nothing when that line misses the opening.
  [[nodiscard]] std::optional<Eigen::Vector3d> ray_through(const Eigen::Vector3d& p) const;
};

// Of every used frame whose mirror is seen from its front. Precondition: the calibration has a world frame.
[[nodiscard]] std::vector<CaughtRays> caught_rays(const Calibration&, const MirrorTarget&);

// Which directions a capture knows at a point, and where on the plane it knows many.
class SessionView {
 public:
  SessionView(std::vector<CaughtRays> rays, PlaneRectangle plane);

  [[nodiscard]] const PlaneRectangle& plane() const { return plane_; }
  [[nodiscard]] std::size_t frames() const { return rays_.size(); }

  // How many frames caught a ray through each cell, one channel, row 0 at max y.
  [[nodiscard]] ImageF counts(int width_px, int height_px) const;

  // A direction of the upper hemisphere from which a frame caught light at a point.
  struct Seen {
    std::size_t frame = 0;               // index in the rays
    Eigen::Vector3d direction_in_plane;  // unit, towards the light
  };
  [[nodiscard]] std::vector<Seen> seen_at(const Eigen::Vector2d& p_in_plane) const;

 private:
  std::vector<CaughtRays> rays_;
  PlaneRectangle plane_;
};

}  // namespace mf
