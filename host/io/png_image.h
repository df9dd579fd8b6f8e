// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/image.h"
#include "common/tiff_image.h"

namespace mf {

// A PNG in memory, its codes as they are: 8 or 16 bits, grey or RGB, alpha dropped. Throws InputError naming `file` for
// palettes, fewer bits, and truncated or damaged data (every chunk's checksum is verified).
[[nodiscard]] StoredImage decode_png(std::string_view bytes, const std::string& file);

// Its alpha, 8 bits; nothing when it has none. Throws likewise.
[[nodiscard]] std::optional<ImageU8> decode_png_alpha(std::string_view bytes, const std::string& file);

// 8 bits, 1 or 3 channels.
[[nodiscard]] std::string encode_png(const ImageU8&);

}  // namespace mf
