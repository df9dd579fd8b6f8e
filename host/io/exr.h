// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "common/image.h"

namespace mf {

// OpenEXR pictures with one channel (Y) or with R, G, B. More channels than asked for are ignored (an A stays unread).
// Throws InputError naming the file when it is missing, damaged, or holds neither; NaN pixels are an error that names
// the first one.
[[nodiscard]] ImageF read_exr(const std::filesystem::path&);
// The same from memory; `file` only names it in errors.
[[nodiscard]] ImageF decode_exr(std::string_view bytes, const std::string& file);

struct ExrOptions {
  bool half = true;                                 // 16-bit float channels; else 32-bit
  bool latlong = false;                             // sets the envmap attribute
  std::map<std::string, std::string> attributes{};  // string attributes, by name
};

// Channels: 1 (Y), 3 (R, G, B) or 4 (R, G, B, A). ZIP; `chromaticities` are BT.709. Written aside and renamed.
void write_exr(const std::filesystem::path&, const ImageF&, const ExrOptions& = {});

}  // namespace mf
