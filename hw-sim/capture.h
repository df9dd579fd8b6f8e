// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/progress.h"

namespace mf::sim {

struct CaptureOptions {
  int frames = 120;        // of the waving mirror, ≥ 10
  int size = 512;          // edge of a frame in pixels, even, 128 to 2048
  std::uint64_t seed = 1;  // leaves, hand, sampling and sensor noise
  int samples = 5;         // paths a pixel in frames, ≥ 1: their noise adds to the sensor's
  int truth_samples = 48;  // paths a pixel in truth pictures, ≥ 1
  int views = 1;           // truth pictures with and without the object, 0 to 3

  // What is wrong, or nothing.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// Simulates a whole recording of desk_scene() and writes it in the import format (docs/import.md): frames.json,
// frames/, camera.json, target.json, world.json, scene.png, sweep.json, sweep/, reference.json, and beside it truth/:
// calibration.json, response.json, views.json, plateN.exr, knot.obj, knotN.exr, probe_0_0_0.1.exr. Same options, same
// bytes. The folder appears whole or not at all. Throws InputError when it exists or cannot be written.
void write_capture(const std::filesystem::path& folder, const CaptureOptions&, const Progress&);

}  // namespace mf::sim
