// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "host/io/view.h"

namespace mf {

// A smooth way past key views, through each of them: `steps` ≥ 1 views from one key to the next, the last key at the
// end. Centres, orientations (as unit quaternions) and focal lengths follow Catmull–Rom splines; picture size and
// distortion are the first key's. Fewer than two keys are returned as they are.
[[nodiscard]] std::vector<View> smooth_path(std::span<const View> keys, int steps);

// As views.json, which read_view reads and `lumigraph --camera-path` takes: a list of {camera_from_world, K,
// distortion, size}. Written aside and renamed.
void write_views(const std::filesystem::path&, std::span<const View>);

}  // namespace mf
