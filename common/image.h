// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mf {

// Pixels by rows, channels interleaved, first row at the top. Pixel (x, y) covers [x, x+1] × [y, y+1].
template <typename T>
struct Image {
  int width = 0;
  int height = 0;
  int channels = 1;
  std::vector<T> data;

  Image() = default;
  Image(int width_px, int height_px, int channel_count, T fill = T{})
      : width(width_px),
        height(height_px),
        channels(channel_count),
        data(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) *
                 static_cast<std::size_t>(channel_count),
             fill) {}

  [[nodiscard]] bool empty() const { return data.empty(); }
  [[nodiscard]] std::size_t index(int x, int y, int c = 0) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels) +
           static_cast<std::size_t>(c);
  }
  [[nodiscard]] T& at(int x, int y, int c = 0) { return data[index(x, y, c)]; }
  [[nodiscard]] const T& at(int x, int y, int c = 0) const { return data[index(x, y, c)]; }
  [[nodiscard]] std::span<T> row(int y) {
    return {data.data() + index(0, y), static_cast<std::size_t>(width) * static_cast<std::size_t>(channels)};
  }
  [[nodiscard]] std::span<const T> row(int y) const {
    return {data.data() + index(0, y), static_cast<std::size_t>(width) * static_cast<std::size_t>(channels)};
  }
};

using ImageF = Image<float>;
using ImageU16 = Image<std::uint16_t>;
using ImageU8 = Image<std::uint8_t>;

}  // namespace mf
