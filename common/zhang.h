// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "common/camera_model.h"
#include "common/homography.h"

namespace mf {

// K in closed form from homographies picture_from_plane of at least three views of a plane, two of them not parallel
// (Zhang 2000, §3.1, without skew): the columns of K⁻¹H are orthogonal and of the same length.
// When the views leave the principal point open or it comes out absurd, it is put into the picture's middle and one
// focal length is solved for, which one tilted view allows. No distortion.
// Nothing when the views don't fix the focal length: all of them face the camera.
[[nodiscard]] std::optional<CameraModel> zhang_intrinsics(std::span<const Homography> picture_from_plane, int width_px,
                                                          int height_px);

}  // namespace mf
