// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/frame.h"
#include "common/progress.h"

namespace mf {

struct ImportInput {
  std::filesystem::path folder;  // in the import format, docs/import.md
};

struct ImportOptions {
  std::filesystem::path session;  // the folder to make
  bool overwrite = false;         // replace it when it is a session already

  [[nodiscard]] std::optional<std::string> validate() const;
};

struct ImportResult {
  PixelFormat format;
  int width = 0;  // pixels
  int height = 0;
  int mirror_frames = 0;
  int scene_frames = 0;
  int sweep_frames = 0;
  int unlisted_files = 0;       // in frames/, not named by frames.json, left out
  double scene_exposure_s = 0;  // 0 without a scene picture
  std::int64_t source_bytes = 0;
  std::int64_t session_bytes = 0;
};

// Makes a session of a folder of frames. Everything is written to a sibling, "SESSION.partial", which is renamed once
// it is complete and durable; after a failure nothing is left. Throws InputError naming the file, the field and the
// remedy for bad input (see read_recording), and for a picture that is missing, damaged, of another size or another
// kind than pixel_format, has codes above its bits or values that are not finite.
[[nodiscard]] ImportResult import_session(const ImportInput&, const ImportOptions&, const Progress&);

}  // namespace mf
