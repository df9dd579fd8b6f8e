// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/picture_file.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "common/error.h"
#include "common/file_bytes.h"
#include "host/io/exr.h"
#include "host/io/image_file.h"
#include "host/io/jpeg_image.h"
#include "host/io/png_image.h"

namespace mf {

namespace {

bool is_jpeg(std::string_view bytes) {
  return bytes.starts_with("\xff\xd8\xff");
}

template <typename T, typename Convert>
auto three_channels(const Image<T>& image, Convert convert) {
  Image<decltype(convert(T{}))> out(image.width, image.height, 3);
  const auto channels = static_cast<std::size_t>(image.channels);
  for (std::size_t i = 0; i < out.data.size(); ++i)
    out.data[i] = convert(image.data[i / 3 * channels + (channels == 1 ? 0 : i % 3)]);
  return out;
}

}  // namespace

Picture read_picture(const std::filesystem::path& path) {
  const std::string bytes = read_file_bytes(path);
  if (is_jpeg(bytes)) return decode_jpeg(bytes, path.string());
  const StoredImage stored = read_stored_image(path);
  if (const auto* linear = std::get_if<ImageF>(&stored.pixels))
    return three_channels(*linear, [](float value) { return value; });
  const auto& codes = std::get<ImageU16>(stored.pixels);
  if (stored.bits_per_sample == 8)
    return three_channels(codes, [](std::uint16_t code) { return static_cast<std::uint8_t>(code); });
  return three_channels(codes, [](std::uint16_t code) { return static_cast<std::uint8_t>((code + 128) / 257); });
}

ImageU8 read_mask(const std::filesystem::path& path) {
  const Picture picture = read_picture(path);
  ImageU8 mask(width_of(picture), height_of(picture), 1);
  for (std::size_t i = 0; i < mask.data.size(); ++i) {
    if (const auto* codes = std::get_if<ImageU8>(&picture))
      mask.data[i] = codes->data[3 * i];
    else
      mask.data[i] = static_cast<std::uint8_t>(255 * std::clamp(std::get<ImageF>(picture).data[3 * i], 0.0F, 1.0F));
  }
  return mask;
}

ImageU8 read_alpha(const std::filesystem::path& path) {
  const std::string bytes = read_file_bytes(path);
  if (!bytes.starts_with("\x89PNG")) return {};
  std::optional<ImageU8> alpha = decode_png_alpha(bytes, path.string());
  const auto says_something = [](std::uint8_t value) { return value != 255; };
  if (!alpha || std::none_of(alpha->data.begin(), alpha->data.end(), says_something)) return {};
  return std::move(*alpha);
}

std::filesystem::path write_picture(const std::filesystem::path& stem, const Picture& picture) {
  std::filesystem::path file = stem;
  if (const auto* codes = std::get_if<ImageU8>(&picture)) {
    file += ".png";
    write_png(file, *codes);
  } else {
    file += ".exr";
    write_exr(file, std::get<ImageF>(picture));
  }
  return file;
}

void read_pictures(const std::vector<PhotoFiles>& files, std::vector<PosedPhoto>& photos) {
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
    photos[i].picture = read_picture(files[i].picture);
    photos[i].mask = files[i].mask.empty() ? read_alpha(files[i].picture) : read_mask(files[i].mask);
  });
}

}  // namespace mf
