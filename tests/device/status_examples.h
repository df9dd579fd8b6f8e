// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "device/rig_status.h"

namespace mf::test {

// What a rig says in the middle of a recording: a picture (from `frame`, or a drawn one when it is empty) of at most
// 256 pixels with eight tags, 45 % covered, with a lamp high in the south that is half seen.
[[nodiscard]] RigStatus recording_status(const ImageU8& frame = {});

// One grey level a pixel of a 16-bit PNG's, with a square root as display curve; empty when it cannot be read.
[[nodiscard]] ImageU8 grey_picture(const std::string& png_file);

}  // namespace mf::test
