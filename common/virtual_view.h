// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/mirror_target.h"
#include "common/rigid3.h"

namespace mf {

using Polygon2 = std::vector<Eigen::Vector2d>;  // corners in order, not repeated

// What the camera sees in the mirror, as the view of a camera behind it.
//
//   S = M F M⁻¹,   M = cam_from_mirror,   F = diag(1, 1, −1, 1)      Ihrke et al. 2008, eq. 2–4
//   x_in_img = project(S · x_in_cam)                                 eq. 5
//
// S is a reflection (det −1), which no rotation can hold: `view_from_cam` is S with image x flipped back
// (view_from_cam = diag(−1, 1, 1, 1) · S), and `flip_x` says so. The centre lies behind the mirror, at S · 0.
struct VirtualView {
  Rigid3 view_from_cam;     // proper pose, metres
  bool flip_x = true;       // image x runs the other way
  Polygon2 opening_in_img;  // the mirror without its tag frame, pixels; empty when it is not in front of the camera

  // Virtual centre in the camera frame.
  [[nodiscard]] Eigen::Vector3d centre_in_cam() const { return view_from_cam.inverse().translation; }

  // S · x: where the camera seems to see the point x, in the camera frame. Visible only when its z > 0.
  [[nodiscard]] Eigen::Vector3d reflected(const Eigen::Vector3d& x_in_cam) const {
    Eigen::Vector3d x = view_from_cam * x_in_cam;
    if (flip_x) x.x() = -x.x();
    return x;
  }
};

// Precondition: the camera is on the mirror's reflecting side (+z); otherwise returns nothing.
[[nodiscard]] std::optional<VirtualView> mirror_view(const Rigid3& cam_from_mirror, const MirrorTarget&,
                                                     const CameraModel&);

}  // namespace mf
