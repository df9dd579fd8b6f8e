// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace mf {

// Appends `bytes`, deflated, to `out` as one zlib stream (RFC 1950), which any inflater reads. For frames at a camera's
// rate, when they repeat themselves: those with noise are literal_deflate.h's. Safe in many threads.
void append_deflated(std::span<const std::uint8_t> bytes, std::string& out);

}  // namespace mf
