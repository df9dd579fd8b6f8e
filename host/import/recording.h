// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "common/session.h"

namespace mf {

struct RecordedFrame {
  std::filesystem::path file;
  FrameInfo info;
};

// What a folder in the import format says, before any picture is read. docs/import.md describes the format:
//   camera.json frames.json frames/ target.json      needed
//   world.json scene.{png,tif,tiff,exr} sweep.json sweep/ reference.json      optional
struct Recording {
  SessionHeader header;               // width and height are 0: only the pictures tell
  std::vector<RecordedFrame> frames;  // mirror frames in the order of frames.json, then the scene, then the sweep
  int unlisted_files = 0;             // files in frames/ that frames.json does not list
};

// Throws InputError naming the file and the field: a file is missing, is no JSON, has an unknown key, a value out of
// its domain, a name listed twice, a tag in both target.json and world.json.
[[nodiscard]] Recording read_recording(const std::filesystem::path& folder);

}  // namespace mf
