// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "common/image.h"
#include "host/render/render.h"

namespace mf {

// What `render` and `composite` have in common.
struct PictureArguments {
  std::filesystem::path field;
  std::filesystem::path object;
  std::filesystem::path cameras;
  std::filesystem::path output;
  int view = 0;
  std::optional<double> albedo;
  std::string backend = "auto";
  double exposure = 1;
  RenderOptions options;
  bool json = false;
};
void add_picture_options(CLI::App& command, PictureArguments&);

// Throws InputError naming the command and the flag for a value that no rendering can have, and for an output that is
// neither .exr nor .png.
void check_picture_arguments(const std::string& command, PictureArguments&);

// Linear, three or four channels, as half-float EXR, or PNG (sRGB, times `exposure`, over black). By the file's name.
void write_picture(const std::filesystem::path&, const ImageF&, double exposure);

// Figures of a rendering for --json.
[[nodiscard]] nlohmann::json rendering_summary(const RenderResult&, double seconds);

}  // namespace mf
