// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "common/frame.h"

namespace mf::test {

// The pixels of the i-th frame of a small recording, whatever its file format.
[[nodiscard]] FramePixels small_pixels(const PixelFormat&, int i);

// A recording in the import format, as a user would lay it out: four frames of 40 × 30, a scene picture, a sweep of
// three filters, a reference. The documents can be changed before write().
struct SmallRecording {
  explicit SmallRecording(const PixelFormat& format = {PixelLayout::bayer_rg, 12, false});

  PixelFormat format;
  std::string extension = "png";  // png, tif or exr
  nlohmann::json camera, frames, target, world, sweep, reference;

  void write(const std::filesystem::path& folder) const;
};

// One picture in the format that the file's extension says.
void write_picture(const std::filesystem::path& file, const FramePixels&, int bits);

}  // namespace mf::test
