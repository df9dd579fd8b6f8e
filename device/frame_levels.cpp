// SPDX-License-Identifier: Apache-2.0
#include "device/frame_levels.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/check.h"

namespace mf {

namespace {

constexpr float knee_level = 200;
constexpr float sixteenths = 16;
constexpr int top_level = 255 * 16;  // nine of them, weighted by 16 in all, still fit into 16 bits

bool is_bayer(PixelLayout layout) {
  return layout != PixelLayout::mono && layout != PixelLayout::rgb;
}

// Where levels stop to be proportional to light, and the brightest there is.
struct Brightness {
  float knee = 0;
  float top = 0;
};

// Of one colour, from one pixel in sixteen: a percentile needs no more. The paper of the tags is the
// brightest of surfaces, brighter than nine tenths of a picture, and should not lie on the shoulder; but a lamp that
// fills a hundredth must not squash it either.
Brightness brightness_of(const ImageU16& codes, const PixelBox& box, const std::vector<float>& exposure, int first_x,
                         int first_y) {
  constexpr double surfaces = 0.9, brightest = 0.99;
  constexpr float paper_over_surfaces = 2;
  std::vector<std::uint32_t> histogram(exposure.size());
  std::uint32_t lit = 0;
  std::size_t top = 0;
  for (int y = box.y + first_y; y < box.y + box.height; y += 4)
    for (int x = box.x + first_x; x < box.x + box.width; x += 4) {
      const std::size_t code = std::min<std::size_t>(codes.at(x, y), exposure.size() - 1);
      if (!(exposure[code] > 0)) continue;
      ++histogram[code];
      ++lit;
      top = std::max(top, code);
    }
  if (lit < 16) return {};
  const auto percentile = [&](double share) {
    double below = 0;
    std::size_t code = 0;
    while (code < top && below + histogram[code] < share * lit) below += histogram[code++];
    return exposure[code];
  };
  return {std::min(percentile(brightest), paper_over_surfaces * percentile(surfaces)), exposure[top]};
}

std::vector<std::uint16_t> level_table(const std::vector<float>& exposure, const Brightness& brightness) {
  std::vector<std::uint16_t> table(exposure.size());
  if (!(brightness.knee > 0)) return table;
  const float shoulder = (255 - knee_level) / std::log(std::sqrt(std::max(brightness.top / brightness.knee, 2.F)));
  for (std::size_t code = 0; code < table.size(); ++code) {
    const float x = std::sqrt(std::max(exposure[code], 0.F) / brightness.knee);
    const float level = x <= 1 ? knee_level * x : knee_level + shoulder * std::log(x);
    table[code] =
        static_cast<std::uint16_t>(std::clamp(static_cast<int>(std::lround(sixteenths * level)), 0, top_level));
  }
  return table;
}

// 1 2 1 along a row, mirrored about its end pixels, which continues a mosaic.
template <typename T>
void smooth_along(const std::vector<T>& in, std::vector<T>& out) {
  const std::size_t n = in.size();
  const auto sum = [](T a, T b, T c) { return static_cast<T>(a + b + b + c); };
  out[0] = sum(in[1], in[0], in[1]);
  for (std::size_t x = 1; x + 1 < n; ++x) out[x] = sum(in[x - 1], in[x], in[x + 1]);
  out[n - 1] = sum(in[n - 2], in[n - 1], in[n - 2]);
}

void smooth_across(const std::uint16_t* above, const std::uint16_t* here, const std::uint16_t* below,
                   std::span<std::uint8_t> out) {
  for (std::size_t x = 0; x < out.size(); ++x)  // the sum is at most 16 · top_level
    out[x] = static_cast<std::uint8_t>((static_cast<unsigned>(above[x]) + 2U * here[x] + below[x] + 128U) >> 8U);
}

}  // namespace

FrameLevels::FrameLevels(const ResponseCurve& response, const PixelFormat& format)
    : format_(format), last_code_(static_cast<std::size_t>(format.level_count()) - 1) {
  check(!format.linear_float && format.layout != PixelLayout::rgb, "the rig's frames are mono or mosaics of codes");
  const auto colours = static_cast<std::size_t>(format.colour_channels());
  check(response.channels.size() == colours, "the response has the frame's channels");
  for (std::size_t c = 0; c < colours; ++c) {
    exposure_[c].resize(last_code_ + 1);
    for (std::size_t code = 0; code <= last_code_; ++code)
      exposure_[c][code] = static_cast<float>(response.exposure_of(static_cast<int>(c), static_cast<double>(code)) *
                                              response.radiance_scale[c]);
  }
}

// One knee for all colours, that of the brightest: the sum that the filter makes of them is then linear, too.
FrameLevels::Stretch FrameLevels::stretch_for(const ImageU16& codes, const PixelBox& box) const {
  Brightness all;
  const int cell = is_bayer(format_.layout) ? 2 : 1;
  for (int y = 0; y < cell; ++y)
    for (int x = 0; x < cell; ++x) {
      const auto colour = static_cast<std::size_t>(colour_at(format_.layout, box.x + x, box.y + y));
      const Brightness b = brightness_of(codes, box, exposure_[colour], x, y);
      all = {std::max(all.knee, b.knee), std::max(all.top, b.top)};
    }
  Stretch out;
  for (std::size_t c = 0; c < static_cast<std::size_t>(format_.colour_channels()); ++c)
    out.level[c] = level_table(exposure_[c], all);
  return out;
}

ImageU8 FrameLevels::levels(const ImageU16& codes, const PixelBox& box) const {
  check(box.x >= 0 && box.y >= 0 && box.x + box.width <= codes.width && box.y + box.height <= codes.height,
        "the box lies in the frame");
  ImageU8 out(box.width, box.height, 1);
  if (box.width < 2 || box.height < 2) return out;
  const Stretch stretch = stretch_for(codes, box);
  const auto width = static_cast<std::size_t>(box.width);
  std::vector<std::uint16_t> row(width);
  const auto look_up = [&](int y, std::size_t first, std::size_t step, const std::vector<std::uint16_t>& table) {
    const std::uint16_t* const from = codes.row(y).data() + box.x;
    for (std::size_t x = first; x < width; x += step) row[x] = table[std::min<std::size_t>(from[x], last_code_)];
  };
  if (!is_bayer(format_.layout)) {
    for (int y = 0; y < box.height; ++y) {
      look_up(box.y + y, 0, 1, stretch.level[0]);
      std::transform(row.begin(), row.end(), out.row(y).begin(),
                     [](std::uint16_t level) { return static_cast<std::uint8_t>((level + 8U) >> 4U); });
    }
    return out;
  }
  std::array<std::vector<std::uint16_t>, 3> smooth;  // rows y − 1, y, y + 1
  for (std::vector<std::uint16_t>& r : smooth) r.resize(width);
  const auto read_row = [&](int y, std::vector<std::uint16_t>& into) {  // y within the box
    for (int phase = 0; phase < 2; ++phase)
      look_up(box.y + y, static_cast<std::size_t>(phase), 2,
              stretch.level[static_cast<std::size_t>(colour_at(format_.layout, box.x + phase, box.y + y))]);
    smooth_along(row, into);
  };
  read_row(1, smooth[0]);  // mirrored about the first row
  read_row(0, smooth[1]);
  for (int y = 0; y < box.height; ++y) {
    if (y + 1 < box.height)
      read_row(y + 1, smooth[2]);
    else
      read_row(box.height - 2, smooth[2]);
    smooth_across(smooth[0].data(), smooth[1].data(), smooth[2].data(), out.row(y));
    std::rotate(smooth.begin(), smooth.begin() + 1, smooth.end());
  }
  return out;
}

ImageF FrameLevels::linear(const ImageU16& codes, const PixelBox& box) const {
  check(box.x >= 0 && box.y >= 0 && box.x + box.width <= codes.width && box.y + box.height <= codes.height,
        "the box lies in the frame");
  ImageF out(box.width, box.height, 1);
  for (int y = 0; y < box.height; ++y)
    for (int x = 0; x < box.width; ++x) {
      const auto colour = static_cast<std::size_t>(colour_at(format_.layout, box.x + x, box.y + y));
      out.at(x, y) = exposure_[colour][std::min<std::size_t>(codes.at(box.x + x, box.y + y), last_code_)];
    }
  if (!is_bayer(format_.layout) || box.width < 2 || box.height < 2) return out;
  const auto width = static_cast<std::size_t>(box.width);
  std::vector<float> row(width);
  std::vector<std::vector<float>> along(static_cast<std::size_t>(box.height), std::vector<float>(width));
  for (int y = 0; y < box.height; ++y) {
    std::copy(out.row(y).begin(), out.row(y).end(), row.begin());
    smooth_along(row, along[static_cast<std::size_t>(y)]);
  }
  const auto mirrored = [&](int y) {
    return along[static_cast<std::size_t>(y < 0 ? 1 : (y == box.height ? box.height - 2 : y))].data();
  };
  for (int y = 0; y < box.height; ++y) {
    const float *above = mirrored(y - 1), *here = mirrored(y), *below = mirrored(y + 1);
    for (std::size_t x = 0; x < width; ++x) out.row(y)[x] = (above[x] + 2 * here[x] + below[x]) / 16;
  }
  return out;
}

ImageF FrameLevels::luminance(const ImageU16& codes, int reduction) const {
  check(reduction >= 2 && reduction % 2 == 0, "a block holds whole cells of a mosaic");
  ImageF out(codes.width / reduction, codes.height / reduction, 1);
  const float share = 1 / static_cast<float>(reduction * reduction);
  const bool bayer = is_bayer(format_.layout);
  for (int y = 0; y < out.height * reduction; ++y) {
    const std::uint16_t* from = codes.row(y).data();
    const auto table = [&](int x) {
      return exposure_[static_cast<std::size_t>(bayer ? colour_at(format_.layout, x, y) : 0)].data();
    };
    const float* const even = table(0);
    const float* const odd = table(1);
    for (float& sum : out.row(y / reduction)) {
      float block = 0;
      for (int i = 0; i < reduction; i += 2, from += 2)
        block += even[std::min<std::size_t>(from[0], last_code_)] + odd[std::min<std::size_t>(from[1], last_code_)];
      sum += share * block;
    }
  }
  return out;
}

ImageU8 preview_of(const ImageF& luminance) {
  ImageU8 out(luminance.width, luminance.height, 1);
  std::vector<float> lit;
  for (const float v : luminance.data)
    if (v > 0) lit.push_back(v);
  if (lit.empty()) return out;
  const auto white = lit.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(lit.size() - 1));
  std::nth_element(lit.begin(), white, lit.end());
  for (std::size_t i = 0; i < out.data.size(); ++i)
    out.data[i] =
        static_cast<std::uint8_t>(std::lround(255 * std::sqrt(std::clamp(luminance.data[i] / *white, 0.F, 1.F))));
  return out;
}

}  // namespace mf
