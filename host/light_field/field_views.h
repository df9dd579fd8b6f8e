// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/camera_model.h"
#include "common/progress.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/calibration/calibration.h"

namespace mf {

// Premultiplied picture: red·a, green·a, blue·a, a. What a window of it shows is Σ(colour·a) / Σa.
// A rim of one empty texel lies around it, so that an interpolation may reach over every edge.
class PremultipliedImage {
 public:
  PremultipliedImage(int width, int height)
      : width_(width),
        height_(height),
        texels_(static_cast<std::size_t>(width + 2) * static_cast<std::size_t>(height + 2), Eigen::Vector4f::Zero()) {}

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  // x from −1 to width, y from −1 to height: the rim is included.
  [[nodiscard]] const Eigen::Vector4f& at(int x, int y) const { return texels_[index(x, y)]; }
  [[nodiscard]] Eigen::Vector4f& at(int x, int y) { return texels_[index(x, y)]; }

  // Bilinear; texel centres at +0.5; nothing (zero) outside.
  [[nodiscard]] Eigen::Vector4f bilinear(float x, float y) const {
    const float u = x + 0.5F, v = y + 0.5F;  // rim included
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(width_ + 1) && v < static_cast<float>(height_ + 1)))
      return Eigen::Vector4f::Zero();
    const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
    const float fx = u - static_cast<float>(x0), fy = v - static_cast<float>(y0);
    const Eigen::Vector4f* top = texels_.data() + index(x0 - 1, y0 - 1);
    const Eigen::Vector4f* bottom = top + width_ + 2;
    return (top[0] * (1 - fx) + top[1] * fx) * (1 - fy) + (bottom[0] * (1 - fx) + bottom[1] * fx) * fy;
  }

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y + 1) * static_cast<std::size_t>(width_ + 2) + static_cast<std::size_t>(x + 1);
  }
  int width_;
  int height_;
  std::vector<Eigen::Vector4f> texels_;
};

// Luminance (Rec. 709) of what a premultiplied texel or window shows; 0 where nothing does.
[[nodiscard]] inline float shown_luminance(const Eigen::Vector4f& premultiplied) {
  if (premultiplied.w() <= 0) return 0;
  return (0.2126F * premultiplied.x() + 0.7152F * premultiplied.y() + 0.0722F * premultiplied.z()) / premultiplied.w();
}

// One mirror frame as a captured view: radiance in the mirror's opening, ready to be looked up from the world.
//
// The view is an ideal pinhole (lens distortion undone) whose centre lies behind the mirror. The weight a is Buehler's
// field-of-view term: 1 inside, falling smoothly to 0 towards the mirror's edge and the picture's border; the tag frame
// has weight 0. Radiance is already divided by the mirror's reflectance.
struct FieldView {
  Eigen::Matrix<float, 3, 4> pixel_from_world;  // (u·w, v·w, w): pixels of level 0 of `levels`, relative to its corner
  Eigen::Vector3f centre_in_world;              // the virtual centre, S · 0
  float focal_px = 0;                           // pixels of level 0 per radian near the axis
  std::vector<PremultipliedImage> levels;       // each half the size of the one before; level 0 has `level0_scale`
  std::size_t frame = 0;                        // index in Calibration::frames

  // Bilinear look-up in a level, at level-0 pixels.
  [[nodiscard]] Eigen::Vector4f fetch(int level, float u, float v) const {
    const float scale = 1.0F / static_cast<float>(1 << level);
    return levels[static_cast<std::size_t>(level)].bilinear(u * scale, v * scale);
  }
};

struct FieldViewOptions {
  double border_fraction = 0.12;  // width of the smooth border, of the opening's shorter side; 0 to 0.5
  double inset_px = 2;  // kept clear of the tag frame beyond that: demosaicing and calibration reach over edges
  bool full_resolution = false;  // level 0 is the demosaiced frame; else each 2×2 cell is one pixel
};

// Every used frame of the calibration whose mirror is seen from its front. Throws InputError when the session has no
// world frame or no usable frame.
[[nodiscard]] std::vector<FieldView> load_field_views(const SessionReader&, const ResponseCurve&, const Calibration&,
                                                      const FieldViewOptions&, const Progress&);

}  // namespace mf
