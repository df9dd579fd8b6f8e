// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/frame.h"
#include "common/session.h"
#include "host/import/recording.h"

namespace mf {

// Reads a recorded picture. Throws InputError naming the file when it is missing or damaged, is of another kind than
// `format` (channels, bits, floating point), has codes above its bits, or values that are not finite.
[[nodiscard]] Frame read_recorded_frame(const RecordedFrame&, const PixelFormat& format);

// Throws InputError naming `frame`'s file unless it is as large as the session's frames, whose first is `first_name`.
void require_size(const RecordedFrame&, const Frame&, const SessionHeader&, const std::string& first_name);

[[nodiscard]] int width_of(const Frame&);
[[nodiscard]] int height_of(const Frame&);

}  // namespace mf
