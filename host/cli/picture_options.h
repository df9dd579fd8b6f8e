// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/command_line/command_line.h"
#include "common/image.h"
#include "host/cli/light_source.h"
#include "host/render/render.h"

namespace mf {

// What `render` and `composite` have in common.
struct PictureArguments {
  std::filesystem::path light;  // light field file or session folder
  std::filesystem::path object;
  std::filesystem::path cameras;
  std::vector<std::filesystem::path> outputs;  // .exr or .png each
  int view = 0;
  std::optional<double> albedo;
  std::string backend = "auto";
  double exposure = 1;
  std::optional<int> directions;
  std::optional<int> extra_directions, bounce_directions, ground_directions;
  ResampleOptions session;
  std::vector<double> rectangle;
  RenderOptions options;
  LightOptions light_options;
  bool json = false;
};
void add_picture_options(CommandLine& command, PictureArguments&);

// Throws InputError naming the command and the flag for a value that no rendering can have, and for an output that is
// neither .exr nor .png. Puts the options together.
void check_picture_arguments(const std::string& command, PictureArguments&);

// Throws InputError naming the object when all of it lies below the plane: light fields hold no light from there.
void check_over_plane(const PictureArguments&, const TriangleMesh& mesh_in_world, const PlaneRectangle&);

// Throws the InputError of a picture that would show neither the object nor what it does.
[[noreturn]] void refuse_unseen(const PictureArguments&, const TriangleMesh& mesh_in_world);

// Linear, three or four channels, to every output: half-float EXR, or PNG (sRGB, times the exposure, over black).
void write_pictures(const PictureArguments&, const ImageF&);
[[nodiscard]] std::string output_lines(const PictureArguments&);  // their names, a line each

// Figures of a rendering for --json.
[[nodiscard]] nlohmann::json rendering_summary(const RenderResult&, const StageSeconds&, double seconds);

}  // namespace mf
