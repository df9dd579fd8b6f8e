// SPDX-License-Identifier: Apache-2.0
#include "common/demosaic.h"

#include <algorithm>

#include "common/check.h"

namespace mf {

namespace {

constexpr int reach = 2;  // of Malvar's 5×5 filters

// 0 1 2 … with the ends mirrored about the end pixels, so that a Bayer order continues beyond the border.
int mirrored(int i, int size) {
  if (size == 1) return 0;
  const int period = 2 * (size - 1);
  const int wrapped = ((i % period) + period) % period;
  return wrapped < size ? wrapped : period - wrapped;
}

ImageF padded(const ImageF& image) {
  ImageF out(image.width + 2 * reach, image.height + 2 * reach, 1);
  for (int y = 0; y < out.height; ++y) {
    const std::span<const float> from = image.row(mirrored(y - reach, image.height));
    const std::span<float> to = out.row(y);
    std::copy(from.begin(), from.end(), to.begin() + reach);
    for (int x = -reach; x < 0; ++x) out.at(x + reach, y) = from[static_cast<std::size_t>(mirrored(x, image.width))];
    for (int x = image.width; x < image.width + reach; ++x)
      out.at(x + reach, y) = from[static_cast<std::size_t>(mirrored(x, image.width))];
  }
  return out;
}

// Five rows around a pixel, and Malvar's four filters (figure 2 of the paper, gains α = 1/2, β = 5/8, γ = 3/4).
struct Window {
  const float* p;        // the pixel itself
  std::ptrdiff_t pitch;  // of a row

  [[nodiscard]] float at(int dx, int dy) const { return p[dy * pitch + dx]; }
  [[nodiscard]] float near_x() const { return at(-1, 0) + at(1, 0); }
  [[nodiscard]] float near_y() const { return at(0, -1) + at(0, 1); }
  [[nodiscard]] float far_x() const { return at(-2, 0) + at(2, 0); }
  [[nodiscard]] float far_y() const { return at(0, -2) + at(0, 2); }
  [[nodiscard]] float diagonal() const { return at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1); }

  // At red or blue: green. At green: the colour of the neighbours in its row, in its column. At red: blue, and back.
  [[nodiscard]] float cross() const { return (4 * p[0] + 2 * (near_x() + near_y()) - far_x() - far_y()) / 8; }
  [[nodiscard]] float row() const { return (5 * p[0] + 4 * near_x() - far_x() - diagonal() + 0.5F * far_y()) / 8; }
  [[nodiscard]] float column() const { return (5 * p[0] + 4 * near_y() - far_y() - diagonal() + 0.5F * far_x()) / 8; }
  [[nodiscard]] float opposite() const { return (6 * p[0] + 2 * diagonal() - 1.5F * (far_x() + far_y())) / 8; }
};

// One row; `colour` is that of the row's red or blue pixels, `other` the one that the row lacks.
void demosaic_row(const float* source, std::ptrdiff_t pitch, int width, bool green_first, std::size_t colour,
                  std::span<float> rgb) {
  const std::size_t other = 2 - colour;
  const auto store = [&](int x, std::size_t c, float value) {
    rgb[static_cast<std::size_t>(x) * 3 + c] = std::max(0.0F, value);
  };
  for (int x = green_first ? 1 : 0; x < width; x += 2) {
    const Window w{source + x, pitch};
    store(x, colour, w.p[0]);
    store(x, 1, w.cross());
    store(x, other, w.opposite());
  }
  for (int x = green_first ? 0 : 1; x < width; x += 2) {
    const Window w{source + x, pitch};
    store(x, colour, w.row());
    store(x, 1, w.p[0]);
    store(x, other, w.column());
  }
}

bool is_mosaic(PixelLayout layout) {
  return layout != PixelLayout::mono && layout != PixelLayout::rgb;
}

ImageF box_halved(const ImageF& image) {
  ImageF out(image.width / 2, image.height / 2, image.channels);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < out.channels; ++c)
        out.at(x, y, c) = (image.at(2 * x, 2 * y, c) + image.at(2 * x + 1, 2 * y, c) + image.at(2 * x, 2 * y + 1, c) +
                           image.at(2 * x + 1, 2 * y + 1, c)) /
                          4;
  return out;
}

}  // namespace

ImageF demosaic(const ImageF& mosaic, PixelLayout layout) {
  if (!is_mosaic(layout)) return mosaic;
  check(mosaic.channels == 1, "a mosaic has one channel");
  ImageF rgb(mosaic.width, mosaic.height, 3);
  if (mosaic.empty()) return rgb;
  const ImageF source = padded(mosaic);
  for (int y = 0; y < mosaic.height; ++y) {
    const bool green_first = colour_at(layout, 0, y) == 1;
    const auto colour = static_cast<std::size_t>(colour_at(layout, green_first ? 1 : 0, y));
    demosaic_row(source.row(y + reach).data() + reach, source.width, mosaic.width, green_first, colour, rgb.row(y));
  }
  return rgb;
}

ImageF bin_cells(const ImageF& mosaic, PixelLayout layout) {
  if (!is_mosaic(layout)) return box_halved(mosaic);
  check(mosaic.channels == 1, "a mosaic has one channel");
  ImageF out(mosaic.width / 2, mosaic.height / 2, 3);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int i = 0; i < 4; ++i) {
        const int c = colour_at(layout, i & 1, i >> 1);
        out.at(x, y, c) += mosaic.at(2 * x + (i & 1), 2 * y + (i >> 1)) * (c == 1 ? 0.5F : 1.0F);
      }
  return out;
}

}  // namespace mf
