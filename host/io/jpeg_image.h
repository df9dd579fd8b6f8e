// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "common/image.h"

namespace mf {

// A JPEG in memory as 8-bit R, G, B (a grey one three times the same). Turned as stored: an EXIF orientation is not
// applied, because poses refer to the pixels. Throws InputError naming `file` for CMYK and for truncated or damaged
// data.
[[nodiscard]] ImageU8 decode_jpeg(std::string_view bytes, const std::string& file);

}  // namespace mf
