// SPDX-License-Identifier: Apache-2.0
#include "host/cli/picture_options.h"

#include <nlohmann/json.hpp>

#include "common/error.h"
#include "host/cli/command.h"
#include "host/io/exr.h"
#include "host/io/image_file.h"

namespace mf {

void add_picture_options(CLI::App& command, PictureArguments& a) {
  command.add_option("field", a.field, "light field (.lf.exr)")->required();
  command.add_option("object", a.object, "mesh to light: OBJ (world coordinates, Z-up) or glTF")->required();
  command.add_option("--cameras", a.cameras, "views.json: camera_from_world and K of each view")->required();
  command.add_option("--view", a.view, "which view of the cameras, from 0")->capture_default_str();
  command.add_option("--albedo", a.albedo, "one albedo for the whole object, 0 to 1, instead of the file's colours");
  command.add_option("--backend", a.backend, "gl, cpu, or auto: gl on a graphics card, else cpu")
      ->capture_default_str();
  command
      .add_option("--extra-directions", a.options.importance.extra_directions,
                  "further shadow directions, spent on the brightest parts of the light")
      ->capture_default_str();
  command
      .add_option("--bounce-directions", a.options.bounce_directions,
                  "directions in which light is followed off the object; 0: not at all")
      ->capture_default_str();
  command
      .add_option("--ground-directions", a.options.ground_directions,
                  "directions in which the object sees the ground's light")
      ->capture_default_str();
  command.add_option("--exposure", a.exposure, "for PNG: radiance is multiplied by this; 1 becomes white")
      ->capture_default_str();
  command.add_option("-o,--output", a.output, "picture to write, .exr (linear) or .png (sRGB)")->required();
  add_json_flag(command, a.json);
}

void check_picture_arguments(const std::string& command, PictureArguments& a) {
  const std::string extension = a.output.extension().string();
  if (extension != ".exr" && extension != ".png")
    throw InputError(command, "--output", "'" + a.output.string() + "' must end in .exr or .png");
  if (a.albedo && !(*a.albedo >= 0 && *a.albedo <= 1))
    throw InputError(command, "--albedo", "must lie between 0 and 1");
  if (!(a.exposure > 0)) throw InputError(command, "--exposure", "must be above 0");
  const auto backend = parse_backend(a.backend);
  if (!backend) throw InputError(command, "--backend", "'" + a.backend + "' is none: use auto, gl or cpu");
  a.options.backend = *backend;
  if (const auto problem = a.options.validate()) throw InputError(command, "", *problem);
}

void write_picture(const std::filesystem::path& file, const ImageF& picture, double exposure) {
  if (file.extension() == ".exr") return write_exr(file, picture);
  ImageF colour(picture.width, picture.height, 3);
  const auto channels = static_cast<std::size_t>(picture.channels);
  for (std::size_t i = 0; i < picture.data.size() / channels; ++i)
    for (std::size_t c = 0; c < 3; ++c) colour.data[3 * i + c] = picture.data[channels * i + c];
  write_png(file, to_srgb8(colour, exposure));
}

nlohmann::json rendering_summary(const RenderResult& r, double seconds) {
  return {{"backend", r.backend},    {"lights", r.lights},        {"points", r.fragments},
          {"width", r.object.width}, {"height", r.object.height}, {"seconds", seconds}};
}

}  // namespace mf
