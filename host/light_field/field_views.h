// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "common/camera_model.h"
#include "common/luminance.h"
#include "common/progress.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/calibration/calibration.h"
#include "host/light_field/half_floats.h"
#include "host/light_field/view_border.h"
#include "host/team/team.h"

namespace mf {

// Premultiplied picture: red·a, green·a, blue·a, a. What a window of it shows is Σ(colour·a) / Σa.
// A rim of one empty texel lies around it, so that an interpolation may reach over every edge.
//
// Texels are half floats, colours in `unit` (a power of two, so that neither the brightest nor the darkest is lost).
class PremultipliedImage {
 public:
  PremultipliedImage(int width, int height, float unit)
      : width_(width),
        height_(height),
        unit_(unit),
        texels_(static_cast<std::size_t>(width + 2) * static_cast<std::size_t>(height + 2)) {}

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  // x from −1 to width, y from −1 to height: the rim is included.
  [[nodiscard]] Eigen::Vector4f at(int x, int y) const { return decoded(half_unshift * shifted(texels_[index(x, y)])); }
  // Negative colours become 0.
  void set(int x, int y, const Eigen::Vector4f& texel);

  // Bilinear; texel centres at +0.5; nothing (zero) outside.
  [[nodiscard]] Eigen::Vector4f bilinear(float x, float y) const {
    Lanes sum{};
    add_bilinear(x, y, 1, sum);
    return decoded(sum);
  }

  void expect(float x, float y) const {
    const float u = x + 0.5F, v = y + 0.5F;
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(width_ + 1) && v < static_cast<float>(height_ + 1))) return;
    const Texel* top = texels_.data() + index(static_cast<int>(u) - 1, static_cast<int>(v) - 1);
    __builtin_prefetch(top);
    __builtin_prefetch(top + width_ + 2);
  }

  // Sums of many look-ups, decoded at their end.
  using Lanes = float __attribute__((vector_size(16)));
  void add_bilinear(float x, float y, float weight, Lanes& sum) const {
    const float u = x + 0.5F, v = y + 0.5F;  // rim included
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(width_ + 1) && v < static_cast<float>(height_ + 1))) return;
    const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
    const float fx = u - static_cast<float>(x0), fy = v - static_cast<float>(y0);
    const Texel* top = texels_.data() + index(x0 - 1, y0 - 1);
    const Texel* bottom = top + width_ + 2;
    const float w = weight * half_unshift, above = w * (1 - fy), below = w * fy;
    sum += shifted(top[0]) * (above * (1 - fx)) + shifted(top[1]) * (above * fx) +
           shifted(bottom[0]) * (below * (1 - fx)) + shifted(bottom[1]) * (below * fx);
  }
  [[nodiscard]] Eigen::Vector4f decoded(const Lanes& sum) const {
    return {sum[0] * unit_, sum[1] * unit_, sum[2] * unit_, sum[3]};
  }

  [[nodiscard]] float unit() const { return unit_; }
  // Everything that set() made, for those who send pictures elsewhere.
  using Texel = std::uint16_t __attribute__((vector_size(8)));
  [[nodiscard]] std::span<const Texel> texels() const { return texels_; }
  [[nodiscard]] std::span<Texel> texels() { return texels_; }

 private:
  static Lanes shifted(const Texel& texel) {
    using Wide = std::uint32_t __attribute__((vector_size(16)));
    const Wide bits = __builtin_convertvector(texel, Wide) << 13U;
    return std::bit_cast<Lanes>(bits);
  }
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y + 1) * static_cast<std::size_t>(width_ + 2) + static_cast<std::size_t>(x + 1);
  }
  int width_;
  int height_;
  float unit_;
  std::vector<Texel> texels_;
};

// Luminance (Rec. 709) of what a premultiplied texel or window shows; 0 where nothing does.
[[nodiscard]] inline float shown_luminance(const Eigen::Vector4f& premultiplied) {
  if (premultiplied.w() <= 0) return 0;
  return luminance_of(premultiplied.head<3>()) / premultiplied.w();
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
  // Has the memory of a look-up that comes soon fetched meanwhile: views are too large for the caches.
  void expect(int level, float u, float v) const {
    const float scale = 1.0F / static_cast<float>(1 << level);
    levels[static_cast<std::size_t>(level)].expect(u * scale, v * scale);
  }
};

// Level 0 and all that follow from it, from its premultiplied texels by rows.
[[nodiscard]] std::vector<PremultipliedImage> make_levels(int width, int height,
                                                          std::span<const Eigen::Vector4f> texels);

struct FieldViewOptions {
  BorderOptions border;
  bool full_resolution = false;  // level 0 is the demosaiced frame; else each 2×2 cell is one pixel
};

// Every used frame of the calibration whose mirror is seen from its front. Throws InputError when the session has no
// world frame or no usable frame. A team loads each frame once, and all get all views.
[[nodiscard]] std::vector<FieldView> load_field_views(const SessionReader&, const ResponseCurve&, const Calibration&,
                                                      const Team&, const Progress&, const FieldViewOptions& = {});

}  // namespace mf
