// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "host/io/view.h"

namespace mf {

// A camera path as a file: a list of views as read_view reads them, a frame each, or
//
//   {"frames": N, "views": [...]}
//
// whose views are key frames, evenly spaced in time; N ≥ 2 frames lead from the first to the last. Throws InputError
// naming the file and the field.
[[nodiscard]] std::vector<View> read_camera_path(const std::filesystem::path&);

// Frames through key frames of one size. Centres follow a Catmull–Rom spline; so do the quaternions of the rotations,
// normalized, which stays close to the shortest turns while key frames are less than a quarter turn apart; the camera's
// numbers change linearly. Precondition: two keys and two frames at least, one size.
[[nodiscard]] std::vector<View> interpolated(const std::vector<View>& keys, int frames);

}  // namespace mf
