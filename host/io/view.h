// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "common/camera_model.h"
#include "common/rigid3.h"

namespace mf {

// A camera that looks at the scene. World is Z-up; camera axes x right, y down, z forward.
struct View {
  CameraModel camera;
  Rigid3 cam_from_world;
};

// One view of `views.json`, a list of {camera_from_world: 4×4, K: 3×3, distortion: [k1, k2, p1, p2, k3] (optional),
// size: [width, height] (optional)}. The size is `size_px` when given (a plate's), else the file's, else twice the
// principal point. Throws InputError naming the file and the field: a missing or singular K, no rigid transform, an
// index that the list does not have, a principal point outside of the picture (a plate of another size).
[[nodiscard]] View read_view(const std::filesystem::path&, int index, std::optional<std::array<int, 2>> size_px = {});

// The same for an entry of such a list that is already read; `prefix` names it in errors, as "[3].".
[[nodiscard]] View view_from_json(const nlohmann::json& entry, const std::string& prefix, const std::string& file,
                                  std::optional<std::array<int, 2>> size_px = {});

}  // namespace mf
