// SPDX-License-Identifier: Apache-2.0
#include "host/io/image_file.h"

#include <algorithm>
#include <cmath>

#include "common/atomic_file.h"
#include "common/check.h"
#include "common/error.h"
#include "common/file_bytes.h"
#include "host/io/exr.h"
#include "host/io/png_image.h"

namespace mf {

namespace {

using namespace std::string_view_literals;

bool is_png(std::string_view bytes) {
  return bytes.starts_with("\x89PNG\r\n\x1a\n"sv);
}
bool is_tiff(std::string_view bytes) {
  // II or MM, then 42, or 43 for BigTIFF
  return bytes.starts_with("II\x2a\0"sv) || bytes.starts_with("MM\0\x2a"sv) || bytes.starts_with("II\x2b\0"sv) ||
         bytes.starts_with("MM\0\x2b"sv);
}
bool is_exr(std::string_view bytes) {
  return bytes.starts_with("\x76\x2f\x31\x01"sv);
}

// IEC 61966-2-1, linear → encoded, both 0 to 1.
float srgb_from_linear(float linear) {
  return linear <= 0.0031308F ? 12.92F * linear : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F;
}

}  // namespace

StoredImage read_stored_image(const std::filesystem::path& path) {
  const std::string bytes = read_file_bytes(path);
  if (is_png(bytes)) return decode_png(bytes, path.string());
  if (is_tiff(bytes)) return decode_tiff(bytes, path.string());
  if (is_exr(bytes)) return {decode_exr(bytes, path.string()), 32};
  throw InputError(path.string(), "",
                   bytes.empty() ? "is empty: copy or record it again" : "is no PNG, TIFF or EXR: convert it to one");
}

FramePixels read_image(const std::filesystem::path& path) {
  return read_stored_image(path).pixels;
}

void write_png(const std::filesystem::path& path, const ImageU8& image) {
  write_file_atomically(path, encode_png(image));
}

ImageU8 to_srgb8(const ImageF& linear, double exposure) {
  check(std::isfinite(exposure) && exposure > 0, "a display exposure is positive");
  const auto scale = static_cast<float>(exposure);
  ImageU8 encoded(linear.width, linear.height, linear.channels);
  std::transform(linear.data.begin(), linear.data.end(), encoded.data.begin(), [scale](float value) {
    const float shown = value * scale;
    const float clipped = shown > 0 ? std::min(shown, 1.0F) : 0.0F;  // NaN becomes black
    return static_cast<std::uint8_t>(std::lround(255 * srgb_from_linear(clipped)));
  });
  return encoded;
}

double display_exposure(const ImageF& linear) {
  std::vector<float> lit;
  for (std::size_t i = 0; i + 2 < linear.data.size(); i += 3) {
    const float brightest = std::max({linear.data[i], linear.data[i + 1], linear.data[i + 2]});
    if (brightest > 0) lit.push_back(brightest);
  }
  if (lit.empty()) return 1;
  const auto at = lit.begin() + static_cast<std::ptrdiff_t>(0.97 * static_cast<double>(lit.size() - 1));
  std::nth_element(lit.begin(), at, lit.end());
  return 0.9 / static_cast<double>(*at);
}

}  // namespace mf
