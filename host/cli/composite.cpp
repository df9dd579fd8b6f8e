// SPDX-License-Identifier: Apache-2.0
#include "host/composite/composite.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/seconds_since.h"
#include "host/cli/command.h"
#include "host/cli/picture_options.h"
#include "host/io/exr.h"

namespace mf {

namespace {

struct CompositeArguments : PictureArguments {
  std::filesystem::path plate;
};

ImageF read_plate(const std::filesystem::path& path) {
  const std::string file = path.string();
  if (path.extension() != ".exr")
    throw InputError(file, "--plate", "must be a linear EXR picture: radiance cannot be had from another format");
  ImageF plate = read_exr(path);
  if (plate.channels == 3) return plate;
  ImageF colour(plate.width, plate.height, 3);
  for (std::size_t i = 0; i < colour.data.size(); ++i) colour.data[i] = plate.data[i / 3];
  return colour;
}

void run(CompositeArguments& a) {
  const auto start = std::chrono::steady_clock::now();
  check_picture_arguments("composite", a);
  const ImageF plate = read_plate(a.plate);
  const View view = read_view(a.cameras, a.view, std::array<int, 2>{plate.width, plate.height});
  const TriangleMesh mesh = read_mesh(a.object, {a.albedo});
  StageSeconds stages;
  const LightSource source = open_light_source("composite", a.light, a.session, stages, progress_bar());
  check_over_plane(a, mesh, plane_of(source));
  a.light_options.plane = LightOptions::Plane::near_object;
  const IncidentLight light = light_for(source, mesh, a.light_options, stages);
  const auto rendering = std::chrono::steady_clock::now();
  const CompositeResult r = composite(light, mesh, plate, view, {a.options}, progress_bar());
  stages["rendering"] = seconds_since(rendering);
  if (r.changed <= 0) refuse_unseen(a, mesh);
  write_pictures(a, r.picture);
  const double seconds = seconds_since(start);
  nlohmann::json summary = rendering_summary(r.layers, stages, seconds);
  summary["changed"] = r.changed;
  print_summary(
      a.json, summary,
      fmt::format("{} triangles into {} × {}, {} directions on {}, {:.1f} % of the picture changed, {:.1f} s\n"
                  "{}",
                  mesh.triangles.size(), plate.width, plate.height, r.layers.lights, r.layers.backend, 100 * r.changed,
                  seconds, output_lines(a)));
}

}  // namespace

void add_composite_command(CommandLine& program) {
  CommandLine command = program.command("composite", "an object and its shadow in a picture of the real place");
  const auto a = std::make_shared<CompositeArguments>();  // shared: the parser's callback outlives this function
  add_picture_options(command, *a);
  command.option("--plate", a->plate, "the picture that the object goes into: linear EXR", Presence::required);
  command.on_run([a] { run(*a); });
}

}  // namespace mf
