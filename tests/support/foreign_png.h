// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "common/image.h"

namespace mf::test {

// A PNG as other programs write it, by libpng's own simplified writer: 8 or 16 bits, 1 (grey), 2 (grey, alpha),
// 3 (RGB) or 4 (RGB, alpha) channels. Returns the file's bytes.
[[nodiscard]] std::string foreign_png(const ImageU16& codes, int bits);
// The same with a palette of two colours.
[[nodiscard]] std::string foreign_palette_png();

void write_bytes(const std::filesystem::path& file, const std::string& bytes);

}  // namespace mf::test
