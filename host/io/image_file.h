// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "common/frame.h"
#include "common/image.h"
#include "common/tiff_image.h"

namespace mf {

// Reads a PNG or TIFF of 8 or 16 bits or a float TIFF, one or three channels (alpha is dropped), or an EXR, as it is:
// no gamma is applied, colour profiles are ignored. 8-bit values keep their range 0…255. The kind is told by the
// content, not by the name. Throws InputError naming the file: missing, truncated, damaged, another kind.
[[nodiscard]] StoredImage read_stored_image(const std::filesystem::path&);
[[nodiscard]] FramePixels read_image(const std::filesystem::path&);

// Display pictures: PNG, 8 bits, 1 or 3 channels. Written aside and renamed.
void write_png(const std::filesystem::path&, const ImageU8&);

// Linear radiance → 8-bit sRGB after multiplying by `exposure` (1: radiance 1 becomes white).
[[nodiscard]] ImageU8 to_srgb8(const ImageF& linear, double exposure);

// Exposure for to_srgb8() under which all but the brightest 3 % of the lit pixels keep their colour. RGB.
[[nodiscard]] double display_exposure(const ImageF& linear);

}  // namespace mf
