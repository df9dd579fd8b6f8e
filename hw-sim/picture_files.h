// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "common/image.h"
#include "hw-sim/scene.h"

namespace mf::sim {

// What the simulator writes. All throw InputError naming the file when it cannot be written.

// One channel of 16-bit codes.
void write_png16(const std::filesystem::path&, const ImageU16&);

// Three channels, half float, BT.709.
void write_rgb_exr(const std::filesystem::path&, const ImageF&);

// Positions and faces.
void write_obj(const std::filesystem::path&, const Mesh&);

}  // namespace mf::sim
