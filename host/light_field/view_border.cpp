// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/view_border.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace mf {

namespace {

constexpr float picture_border_px = 12;  // a frame that cuts the mirror fades out as softly as the mirror's edge

float smooth_step(float x) {
  const float t = std::min(std::max(x, 0.0F), 1.0F);
  return t * t * (3 - 2 * t);
}

// The mirror's surface as seen by an ideal pinhole: ray (x, y, 1) in the camera → (x·w, y·w, w) on the mirror, metres.
Eigen::Matrix3d mirror_from_ray(const Rigid3& cam_from_mirror) {
  const Eigen::Matrix3d r = cam_from_mirror.rotation.toRotationMatrix();
  Eigen::Matrix3d cam_from_surface;
  cam_from_surface << r.col(0), r.col(1), cam_from_mirror.translation;
  return cam_from_surface.inverse();
}

}  // namespace

ViewBorder::ViewBorder(const CameraModel& camera, const MirrorTarget& target, const Rigid3& cam_from_mirror,
                       const BorderOptions& options, double scale)
    : half_opening_((0.5 * target.opening_m).cast<float>()),
      picture_(static_cast<float>(camera.width), static_cast<float>(camera.height)),
      border_m_(static_cast<float>(options.border_fraction * target.opening_m.minCoeff())),
      inset_px_(static_cast<float>(options.inset_px)),
      scale_(static_cast<float>(scale)) {
  Eigen::Matrix3d ray_from_pixel;
  ray_from_pixel << 1 / (scale * camera.fx()), 0, -camera.cx() / camera.fx(), 0, 1 / (scale * camera.fy()),
      -camera.cy() / camera.fy(), 0, 0, 1;
  mirror_from_pixel_ = (mirror_from_ray(cam_from_mirror) * ray_from_pixel).cast<float>();
}

void ViewBorder::weigh_row(int x0, int y, std::span<const float> u, std::span<const float> v,
                           std::span<float> weights) const {
  const Eigen::Matrix3f& m = mirror_from_pixel_;
  const Eigen::Vector3f start = m * Eigen::Vector3f(static_cast<float>(x0) + 0.5F, static_cast<float>(y) + 0.5F, 1);
  const float sharp = border_m_ > 0 ? 1 / border_m_ : 1e30F;  // no border: a step
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const float t = static_cast<float>(i);
    const float w = start.z() + t * m(2, 0), inverse = 1 / w;
    const float x = (start.x() + t * m(0, 0)) * inverse, y_m = (start.y() + t * m(1, 0)) * inverse;
    // Metres on the mirror that a camera pixel covers: the position's derivatives along picture x and y.
    const float per_px_x = std::abs((m(0, 0) - x * m(2, 0)) * inverse) + std::abs((m(0, 1) - x * m(2, 1)) * inverse);
    const float per_px_y =
        std::abs((m(1, 0) - y_m * m(2, 0)) * inverse) + std::abs((m(1, 1) - y_m * m(2, 1)) * inverse);
    const float inset = inset_px_ * scale_;
    const float clear = std::min(half_opening_.x() - std::abs(x) - inset * per_px_x,
                                 half_opening_.y() - std::abs(y_m) - inset * per_px_y);
    const float mirror_edge = w > 0 ? smooth_step(clear * sharp) : 0.0F;
    const float picture_edge = std::min(std::min(u[i], v[i]), std::min(picture_.x() - u[i], picture_.y() - v[i]));
    weights[i] = mirror_edge * smooth_step((picture_edge - inset_px_) / picture_border_px);
  }
}

}  // namespace mf
