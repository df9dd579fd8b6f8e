// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

namespace mf {

// The moments that a camera path's frames show, seconds: the "time" of each of its views, linear in between when they
// are key frames ({"frames": N, "views": [...]}). Empty when no view has one. Throws InputError naming the file and the
// field: a view with a time and one without, a time that is no number.
[[nodiscard]] std::vector<double> read_path_times(const std::filesystem::path&);

}  // namespace mf
