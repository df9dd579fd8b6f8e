// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/binned_radiance.h"

#include <array>

#include "common/demosaic.h"

namespace mf {

namespace {

bool is_mosaic(PixelLayout layout) {
  return layout != PixelLayout::mono && layout != PixelLayout::rgb;
}

ImageF cropped(const ImageF& image, const PixelBox& box) {
  ImageF out(box.width(), box.height(), image.channels);
  for (int y = 0; y < out.height; ++y) {
    const float* from = &image.data[image.index(box.x0, box.y0 + y)];
    std::copy_n(from, out.row(y).size(), out.row(y).data());
  }
  return out;
}

// Code → radiance for the four pixels of a cell, and which colour each is; green, seen twice, counts half each time.
struct CellTables {
  std::array<std::vector<float>, 3> by_colour;
  std::array<std::size_t, 4> colour{};

  CellTables(const ResponseCurve& curve, PixelLayout layout, double exposure_s) {
    for (int c = 0; c < 3; ++c)
      by_colour[static_cast<std::size_t>(c)] = radiance_table(curve, c, c == 1 ? 2 * exposure_s : exposure_s);
    for (int i = 0; i < 4; ++i)
      colour[static_cast<std::size_t>(i)] = static_cast<std::size_t>(colour_at(layout, i & 1, i >> 1));
  }
};

void bin_row(const ImageU16& codes, const CellTables& tables, const PixelBox& box, int y, std::span<float> out) {
  std::fill(out.begin(), out.end(), 0.0F);
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t colour = tables.colour[i];
    const std::vector<float>& table = tables.by_colour[colour];
    const std::size_t last = table.size() - 1;
    const std::uint16_t* code = &codes.at(2 * box.x0 + static_cast<int>(i & 1), 2 * y + static_cast<int>(i >> 1));
    for (std::size_t x = 0; x < static_cast<std::size_t>(box.width()); ++x)
      out[3 * x + colour] += table[std::min<std::size_t>(code[2 * x], last)];
  }
}

void remove_vignetting(const Vignetting& vignetting, const PixelBox& box, ImageF& cells) {
  for (int y = 0; y < cells.height; ++y)
    for (int x = 0; x < cells.width; ++x) {
      const float factor = static_cast<float>(1 / vignetting.gain(2 * (box.x0 + x) + 1, 2 * (box.y0 + y) + 1));
      for (int c = 0; c < 3; ++c) cells.at(x, y, c) *= factor;
    }
}

}  // namespace

ImageF binned_radiance(const Frame& frame, const PixelFormat& format, const ResponseCurve& curve, const PixelBox& box) {
  if (format.linear_float || !is_mosaic(format.layout))
    return cropped(bin_cells(linearize(frame, format, curve), format.layout), box);
  const CellTables tables(curve, format.layout, frame.info.effective_exposure_s());
  ImageF cells(box.width(), box.height(), 3);
  for (int y = 0; y < cells.height; ++y)
    bin_row(std::get<ImageU16>(frame.pixels), tables, box, box.y0 + y, cells.row(y));
  if (!curve.vignetting.is_identity()) remove_vignetting(curve.vignetting, box, cells);
  return cells;
}

}  // namespace mf
