// SPDX-License-Identifier: Apache-2.0
#include "host/cli/picture_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "host/cli/command.h"
#include "host/io/exr.h"
#include "host/io/image_file.h"

namespace mf {

void add_picture_options(CommandLine& command, PictureArguments& a) {
  command.option("light", a.light,
                 "light field (.lf.exr), or a session folder with response.json and calibration.json, from which the "
                 "light is resampled as the picture needs it",
                 Presence::required);
  command.option("object", a.object, "mesh to light: OBJ (world coordinates, Z-up) or glTF", Presence::required);
  command.option("--cameras", a.cameras, "views.json: camera_from_world and K of each view", Presence::required);
  command.option("--view", a.view, "which view of the cameras, from 0");
  command.option("--albedo", a.albedo, "one albedo for the whole object, 0 to 1, instead of the file's colours");
  command.option("--backend", a.backend, "gl, cpu, or auto: gl on a graphics card, else cpu");
  command.option("--directions", a.directions,
                 "a preview with this many directions, the most important ones finely (default: all that there are)");
  command.option("--extra-directions", a.extra_directions,
                 "further shadow directions, spent on the brightest parts of the light (default: 700, in a preview at "
                 "most --directions)");
  command.option("--bounce-directions", a.bounce_directions,
                 "directions in which light is followed off the object; 0: not at all (default: 500, in a preview at "
                 "most --directions)");
  command.option("--ground-directions", a.ground_directions,
                 "directions in which the object sees the ground's light (default: 800, in a preview at most "
                 "--directions)");
  command.option("--exposure", a.exposure, "for PNG: radiance is multiplied by this; 1 becomes white");
  command.repeatable("-o,--output", a.outputs, "picture to write, .exr (linear) or .png (sRGB); may be given again",
                     Presence::required);
  command.option("--height", a.session.height_m, "session: height of the light-field plane, as for `resample`");
  command.option("--proxy", a.session.proxy, "session: what the views are focused on, as for `resample`");
  command.option("-k", a.session.k, "session: views blended for a ray, as for `resample`");
  command.values("--rectangle", 4, a.rectangle, "session: x0 y0 x1 y1 of the plane's rectangle, as for `resample`");
  add_json_flag(command, a.json);
}

namespace {

// What was given counts; else the usual number, of which a preview takes no more than it has directions.
void set_directions(PictureArguments& a) {
  constexpr int fewest = 16;  // that the ground and the bounce may have
  const auto set = [&](int& usual, std::optional<int> given) {
    usual = given.value_or(std::min(usual, std::max(fewest, a.directions.value_or(usual))));
  };
  a.light_options.directions = a.directions.value_or(0);
  set(a.light_options.importance.extra_directions, a.extra_directions);
  set(a.options.bounce_directions, a.bounce_directions);
  set(a.options.ground_directions, a.ground_directions);
}

}  // namespace

void check_picture_arguments(const std::string& command, PictureArguments& a) {
  for (const std::filesystem::path& output : a.outputs)
    if (output.extension() != ".exr" && output.extension() != ".png")
      throw InputError(command, "--output", "'" + output.string() + "' must end in .exr or .png");
  for (const std::filesystem::path& output : a.outputs) check_folder_of(output);
  if (a.albedo && !(*a.albedo >= 0 && *a.albedo <= 1))
    throw InputError(command, "--albedo", "must lie between 0 and 1");
  if (!(a.exposure > 0)) throw InputError(command, "--exposure", "must be above 0");
  const auto backend = parse_backend(a.backend);
  if (!backend) throw InputError(command, "--backend", "'" + a.backend + "' is none: use auto, gl or cpu");
  a.options.backend = *backend;
  if (!a.rectangle.empty()) a.session.rectangle = {a.rectangle[0], a.rectangle[1], a.rectangle[2], a.rectangle[3]};
  if (a.directions && *a.directions < 1) throw InputError(command, "--directions", "must be at least 1");
  set_directions(a);
  if (const auto problem = a.light_options.validate()) throw InputError(command, "", *problem);
  if (const auto problem = a.options.validate()) throw InputError(command, "", *problem);
}

void check_over_plane(const PictureArguments& a, const TriangleMesh& mesh_in_world, const PlaneRectangle& plane) {
  const Bounds bounds = bounds_of(transformed(plane.world_from_plane.inverse(), mesh_in_world));
  constexpr float rounding_m = 1e-4F;  // what lies on the plane stays
  if (bounds.high.z() < -rounding_m)
    throw InputError(a.object.string(), "",
                     fmt::format("lies wholly below the light field's plane (up to {:.3g} m under it), where no light "
                                 "comes down to: give it world coordinates, metres, Z-up",
                                 -bounds.low.z()));
}

void refuse_unseen(const PictureArguments& a, const TriangleMesh& mesh_in_world) {
  const Bounds bounds = bounds_of(mesh_in_world);
  throw InputError(
      a.cameras.string(), fmt::format("[{}]", a.view),
      fmt::format("shows nothing of {}, which is {:.3g} m wide about ({:.3g}, {:.3g}, {:.3g}): is it in "
                  "world coordinates, metres, Z-up? Else give another --view",
                  a.object.string(), 2 * bounds.radius, bounds.centre.x(), bounds.centre.y(), bounds.centre.z()));
}

void write_pictures(const PictureArguments& a, const ImageF& picture) {
  ImageF colour(picture.width, picture.height, 3);
  const auto channels = static_cast<std::size_t>(picture.channels);
  for (std::size_t i = 0; i < picture.data.size() / channels; ++i)
    for (std::size_t c = 0; c < 3; ++c) colour.data[3 * i + c] = picture.data[channels * i + c];
  for (const std::filesystem::path& output : a.outputs)
    if (output.extension() == ".exr")
      write_exr(output, picture);
    else
      write_png(output, to_srgb8(colour, a.exposure));
}

std::string output_lines(const PictureArguments& a) {
  std::string lines;
  for (const std::filesystem::path& output : a.outputs) lines += output.string() + "\n";
  return lines;
}

nlohmann::json rendering_summary(const RenderResult& r, const StageSeconds& stages, double seconds) {
  return {{"backend", r.backend},      {"lights", r.lights}, {"points", r.fragments},     {"width", r.object.width},
          {"height", r.object.height}, {"seconds", seconds}, {"seconds_by_stage", stages}};
}

}  // namespace mf
