// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/exr_chunk.h"

#include "common/fast_deflate.h"

namespace mf {

std::string zip_chunk(std::span<const std::uint8_t> raw) {
  thread_local std::vector<std::uint8_t> split, differences;
  const std::size_t size = raw.size(), evens = (size + 1) / 2;
  split.resize(size);
  differences.resize(size);
  for (std::size_t i = 0; i < size / 2; ++i) {
    split[i] = raw[2 * i];
    split[evens + i] = raw[2 * i + 1];
  }
  if (size % 2 == 1) split[evens - 1] = raw[size - 1];
  if (size > 0) differences[0] = split[0];
  constexpr unsigned bias = 128;
  for (std::size_t i = 1; i < size; ++i)
    differences[i] = static_cast<std::uint8_t>(unsigned{split[i]} - split[i - 1] + bias);
  std::string packed;
  append_deflated(differences, packed);
  if (packed.size() >= size) packed.assign(raw.begin(), raw.end());
  return packed;
}

}  // namespace mf
