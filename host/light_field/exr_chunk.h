// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace mf {

// OpenEXR's ZIP compression of one chunk (a tile, or a block of scan lines), several times faster than OpenEXR's own
// through zlib: any reader of OpenEXR inflates it. Bytes are split into the even and the odd ones, differences of
// neighbours taken, and deflated; `raw` itself when that is no smaller (then readers take it as it is).
//
// `raw`: line after line, in each line channel after channel by name, little endian.
[[nodiscard]] std::string zip_chunk(std::span<const std::uint8_t> raw);

}  // namespace mf
