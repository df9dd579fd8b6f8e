// SPDX-License-Identifier: Apache-2.0
#include "host/report/html.h"

#include <png.h>

#include <vector>

#include "common/check.h"

namespace mf {

namespace {

std::vector<unsigned char> encode_png(const ImageU8& picture) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(picture.width);
  png.height = static_cast<png_uint_32>(picture.height);
  png.format = picture.channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  png_alloc_size_t size = 0;
  check(png_image_write_to_memory(&png, nullptr, &size, 0, picture.data.data(), 0, nullptr) != 0, "a PNG has a size");
  std::vector<unsigned char> bytes(size);
  check(png_image_write_to_memory(&png, bytes.data(), &size, 0, picture.data.data(), 0, nullptr) != 0, "a PNG encodes");
  bytes.resize(size);
  return bytes;
}

// RFC 4648.
std::string base64(const std::vector<unsigned char>& bytes) {
  constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8U | (k < count ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? alphabet[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

}  // namespace

std::string html_escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string png_data_uri(const ImageU8& picture) {
  check(!picture.empty() && (picture.channels == 1 || picture.channels == 3), "a PNG has one or three channels");
  return "data:image/png;base64," + base64(encode_png(picture));
}

}  // namespace mf
