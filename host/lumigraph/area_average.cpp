// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/area_average.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

#include "common/check.h"

namespace mf {

namespace {

// Pixels of the source that a target pixel covers along one axis, and how much each counts: the lengths of overlap.
struct Overlap {
  int first = 0;
  std::vector<float> weights;
};

std::vector<Overlap> overlaps(int source, int target) {
  std::vector<Overlap> all(static_cast<std::size_t>(target));
  const double step = static_cast<double>(source) / target;
  for (int i = 0; i < target; ++i) {
    const double low = i * step;
    const double high = std::min<double>(source, (i + 1) * step);
    Overlap& o = all[static_cast<std::size_t>(i)];
    o.first = static_cast<int>(low);
    for (int j = o.first; j < source && j < high; ++j)
      o.weights.push_back(static_cast<float>((std::min(high, j + 1.0) - std::max<double>(low, j)) / (high - low)));
  }
  return all;
}

template <typename T>
Image<T> average(const Image<T>& image, int width, int height) {
  check(width >= 1 && height >= 1 && width <= image.width && height <= image.height, "an average is no enlargement");
  const std::vector<Overlap> columns = overlaps(image.width, width);
  const std::vector<Overlap> rows = overlaps(image.height, height);
  const auto channels = static_cast<std::size_t>(image.channels);
  Image<T> out(width, height, image.channels);
  std::vector<float> column_sums(static_cast<std::size_t>(image.width) * channels);
  for (int y = 0; y < height; ++y) {
    const Overlap& row = rows[static_cast<std::size_t>(y)];
    std::fill(column_sums.begin(), column_sums.end(), 0.0F);
    for (std::size_t j = 0; j < row.weights.size(); ++j) {
      const auto source = image.row(row.first + static_cast<int>(j));
      for (std::size_t i = 0; i < column_sums.size(); ++i)
        column_sums[i] += row.weights[j] * static_cast<float>(source[i]);
    }
    for (int x = 0; x < width; ++x) {
      const Overlap& column = columns[static_cast<std::size_t>(x)];
      for (std::size_t c = 0; c < channels; ++c) {
        float sum = 0;
        for (std::size_t i = 0; i < column.weights.size(); ++i)
          sum += column.weights[i] * column_sums[(static_cast<std::size_t>(column.first) + i) * channels + c];
        if constexpr (std::is_integral_v<T>)
          out.at(x, y, static_cast<int>(c)) = static_cast<T>(std::lround(sum));
        else
          out.at(x, y, static_cast<int>(c)) = sum;
      }
    }
  }
  return out;
}

}  // namespace

ImageU8 area_average(const ImageU8& image, int width, int height) {
  return average(image, width, height);
}

ImageF area_average(const ImageF& image, int width, int height) {
  return average(image, width, height);
}

}  // namespace mf
