// SPDX-License-Identifier: Apache-2.0
#include "tests/support/foreign_png.h"

#include <png.h>

#include <array>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace mf::test {

namespace {

std::string write_to_memory(png_image& image, const void* pixels, const void* colour_map) {
  png_alloc_size_t size = 0;
  png_image_write_get_memory_size(image, size, 0, pixels, 0, colour_map);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels, 0, colour_map) == 0)
    throw std::runtime_error(image.message);
  bytes.resize(size);
  return bytes;
}

}  // namespace

std::string foreign_png(const ImageU16& codes, int bits) {
  constexpr std::array<png_uint_32, 4> formats{PNG_FORMAT_GRAY, PNG_FORMAT_GA, PNG_FORMAT_RGB, PNG_FORMAT_RGBA};
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(codes.width);
  image.height = static_cast<png_uint_32>(codes.height);
  image.format = formats.at(static_cast<std::size_t>(codes.channels - 1));
  if (bits == 16) {
    image.format |= PNG_FORMAT_FLAG_LINEAR;  // 16 bits, stored as they are when there is no alpha
    return write_to_memory(image, codes.data.data(), nullptr);
  }
  std::vector<png_byte> bytes;
  for (const std::uint16_t code : codes.data) bytes.push_back(static_cast<png_byte>(code));
  return write_to_memory(image, bytes.data(), nullptr);
}

std::string foreign_palette_png() {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = 4;
  image.height = 4;
  image.format = PNG_FORMAT_RGB_COLORMAP;
  image.colormap_entries = 2;
  const std::array<png_byte, 6> colours{0, 0, 0, 255, 200, 100};
  const std::array<png_byte, 16> pixels{0, 1, 0, 1, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1};
  return write_to_memory(image, pixels.data(), colours.data());
}

void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace mf::test
