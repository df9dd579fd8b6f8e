// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/progress.h"
#include "common/response_curve.h"
#include "hw-sim/desk_rig.h"

namespace mf::sim {

// target.json and world.json of a rig (docs/import.md).
void write_target(const std::filesystem::path& folder, const MirrorTarget&);
void write_world(const std::filesystem::path& folder, const WorldTarget&);

struct TruthOptions {
  std::uint64_t seed = 1;
  int samples = 48;  // paths a pixel, ≥ 1
  int views = 1;     // pictures with and without the object, 0 to 3
};

// What only a simulation knows, as files in the folder `truth`: calibration.json (K, cam_from_world, and
// world_from_mirror frame by frame), response.json (when it is given), views.json, plateN.exr, knot.obj, knotN.exr,
// probe_0_0_0.1.exr. `plate` is the rig's own view without the mirror, traced already.
void write_truth(const std::filesystem::path& truth, const DeskRig&, const std::vector<Rigid3>& poses,
                 const std::optional<ResponseCurve>&, const ImageF& plate, const TruthOptions&, const Progress&);

}  // namespace mf::sim
