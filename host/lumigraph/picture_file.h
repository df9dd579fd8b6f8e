// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "host/lumigraph/posed_photo.h"

namespace mf {

// Three channels of a JPEG, PNG or TIFF as 8-bit codes (16-bit ones are rounded to 8, grey is repeated), or of an EXR
// or a float TIFF as linear floats. Throws InputError naming the file.
[[nodiscard]] Picture read_picture(const std::filesystem::path&);

// One channel, 8 bits: the first of the file's.
[[nodiscard]] ImageU8 read_mask(const std::filesystem::path&);

// The alpha of a PNG, where it has one and it is not 255 everywhere: as a mask, 0 says nothing. Empty otherwise.
[[nodiscard]] ImageU8 read_alpha(const std::filesystem::path&);

// 8-bit codes as PNG, linear floats as EXR: `stem` gets the extension. Returns the file.
std::filesystem::path write_picture(const std::filesystem::path& stem, const Picture&);

// Reads the pictures (and masks) of photos, several at once. Without a mask file a picture's alpha is its mask.
struct PhotoFiles {
  std::filesystem::path picture;
  std::filesystem::path mask;
};
void read_pictures(const std::vector<PhotoFiles>& files, std::vector<PosedPhoto>& photos);

}  // namespace mf
