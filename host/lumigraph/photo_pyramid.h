// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <variant>
#include <vector>

#include "host/lumigraph/posed_photo.h"

namespace mf {

// Four floats that the compiler keeps in one register: red, green, blue and nothing.
using Float4 = float __attribute__((vector_size(16)));

// Four values in memory as floats.
inline Float4 load_four(const float* values) {
  Float4 four;
  std::memcpy(&four, values, sizeof four);
  return four;
}
inline Float4 load_four(const std::uint8_t* values) {
  using Words = std::uint32_t __attribute__((vector_size(16)));
  using Integers = std::int32_t __attribute__((vector_size(16)));
  std::uint32_t packed;
  std::memcpy(&packed, values, sizeof packed);
  // Shifts of one word; a conversion of four bytes would be done one by one.
  const Words words = (Words{packed, packed, packed, packed} >> Words{0, 8, 16, 24}) & 255U;
  return __builtin_convertvector(Integers(words), Float4);
}

// A photo at full, half, quarter ... size, four values a texel so that one load brings a colour.
template <typename T>
class PhotoPyramid {
 public:
  struct Level {
    float scale_x = 1;  // level pixels for each pixel of the photo
    float scale_y = 1;
    int width = 0;
    int height = 0;
    std::vector<T> texels;  // four a pixel

    [[nodiscard]] const T* texel(int x, int y) const {
      return texels.data() +
             4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    }
    [[nodiscard]] Float4 at(int x, int y) const { return load_four(texel(x, y)); }
  };

  explicit PhotoPyramid(const Image<T>& photo);

  [[nodiscard]] const std::vector<Level>& levels() const { return levels_; }  // the finest first, the last 1 × 1

  // The photo at pixel position (x, y) of its full size, filtered to texels of 2^lod pixels, lod ≥ 0: bilinear in two
  // levels and linear between them. Positions outside are moved to the border.
  [[nodiscard]] Float4 sample(float x, float y, float lod) const {
    const auto below = static_cast<std::size_t>(lod);
    const float between = lod - static_cast<float>(below);
    const Float4 fine = bilinear(levels_[std::min(below, levels_.size() - 1)], x, y);
    if (between < negligible_lod || below + 1 >= levels_.size()) return fine;
    const Float4 coarse = bilinear(levels_[below + 1], x, y);
    return fine + between * (coarse - fine);
  }

 private:
  static constexpr float negligible_lod = 1e-3F;  // changes a colour by less than a thousandth of a level's detail

  [[nodiscard]] static Float4 bilinear(const Level& level, float x, float y) {
    const float u = std::clamp(x * level.scale_x - 0.5F, 0.0F, static_cast<float>(level.width - 1));
    const float v = std::clamp(y * level.scale_y - 0.5F, 0.0F, static_cast<float>(level.height - 1));
    const int x0 = static_cast<int>(u);
    const int y0 = static_cast<int>(v);
    const int x1 = std::min(x0 + 1, level.width - 1);
    const int y1 = std::min(y0 + 1, level.height - 1);
    const float a = u - static_cast<float>(x0);
    const float b = v - static_cast<float>(y0);
    const Float4 top = level.at(x0, y0) + a * (level.at(x1, y0) - level.at(x0, y0));
    const Float4 bottom = level.at(x0, y1) + a * (level.at(x1, y1) - level.at(x0, y1));
    return top + b * (bottom - top);
  }

  std::vector<Level> levels_;
};

extern template class PhotoPyramid<std::uint8_t>;
extern template class PhotoPyramid<float>;

// The pyramids of a set, all of one kind.
using PhotoPyramids = std::variant<std::vector<PhotoPyramid<std::uint8_t>>, std::vector<PhotoPyramid<float>>>;

[[nodiscard]] PhotoPyramids make_pyramids(const PhotoSet&);

}  // namespace mf
