// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "device/pixel_packing.h"

namespace mf::sim {

// The inverse of unpack(): codes as the camera sends them. Precondition: `bytes` holds bytes_for(codes.size()); codes
// are within the format's bits.
void pack(const WireFormat&, std::span<const std::uint16_t> codes, std::span<std::uint8_t> bytes);

}  // namespace mf::sim
