// SPDX-License-Identifier: Apache-2.0
#include "host/render/render.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/error.h"
#include "common/seconds_since.h"
#include "host/cli/command.h"
#include "host/cli/picture_options.h"

namespace mf {

namespace {

struct RenderArguments : PictureArguments {
  std::optional<double> ground_albedo;
  std::vector<int> size_px;
};

// The object over a diffuse ground.
void add_ground(ImageF& picture, const RenderResult& r, double albedo) {
  const auto scale = static_cast<float>(albedo / std::numbers::pi);
  for (std::size_t i = 0; i < picture.data.size() / 4; ++i) {
    const float uncovered = 1 - picture.data[4 * i + 3];
    bool ground = false;
    for (std::size_t c = 0; c < 3; ++c) {
      picture.data[4 * i + c] += uncovered * scale * r.ground_with.data[3 * i + c];
      ground = ground || r.ground_without.data[3 * i + c] > 0;
    }
    if (ground) picture.data[4 * i + 3] = 1;
  }
}

bool is_uncovered(const ImageF& rgba) {
  for (std::size_t i = 3; i < rgba.data.size(); i += 4)
    if (rgba.data[i] > 0) return false;
  return true;
}

void run(RenderArguments& a) {
  const auto start = std::chrono::steady_clock::now();
  check_picture_arguments("render", a);
  if (a.ground_albedo && !(*a.ground_albedo >= 0 && *a.ground_albedo <= 1))
    throw InputError("render", "--ground-albedo", "must lie between 0 and 1");
  std::optional<std::array<int, 2>> size;
  if (!a.size_px.empty()) {
    size = std::array<int, 2>{a.size_px[0], a.size_px[1]};
    if ((*size)[0] < 1 || (*size)[1] < 1 || (*size)[0] > 32768 || (*size)[1] > 32768)
      throw InputError("render", "--size", "must be a width and a height from 1 to 32768 pixels");
  }
  const View view = read_view(a.cameras, a.view, size);
  const TriangleMesh mesh = read_mesh(a.object, {a.albedo});
  StageSeconds stages;
  const LightSource source = open_light_source("render", a.light, a.session, stages, progress_bar());
  check_over_plane(a, mesh, plane_of(source));
  a.light_options.plane = a.ground_albedo ? LightOptions::Plane::all : LightOptions::Plane::none;
  const IncidentLight light = light_for(source, mesh, a.light_options, stages);
  const auto rendering = std::chrono::steady_clock::now();
  RenderInput input{light, mesh, view, std::nullopt};
  if (a.ground_albedo) input.ground = diffuse_ground(light, mesh, *a.ground_albedo);
  const RenderResult r = render(input, a.options, progress_bar());
  stages["rendering"] = seconds_since(rendering);
  ImageF picture = r.object;
  if (a.ground_albedo) add_ground(picture, r, *a.ground_albedo);
  if (is_uncovered(picture)) refuse_unseen(a, mesh);
  write_pictures(a, picture);
  const double seconds = seconds_since(start);
  print_summary(a.json, rendering_summary(r, stages, seconds),
                fmt::format("{} × {}, {} triangles, {} directions on {}, {:.1f} s\n{}", view.camera.width,
                            view.camera.height, mesh.triangles.size(), r.lights, r.backend, seconds, output_lines(a)));
}

}  // namespace

void add_render_command(CommandLine& program) {
  CommandLine command = program.command("render", "an object in the captured light");
  const auto a = std::make_shared<RenderArguments>();  // shared: the parser's callback outlives this function
  add_picture_options(command, *a);
  command.option("--ground-albedo", a->ground_albedo,
                 "show the light field's plane too, as a diffuse ground of this albedo");
  command.values("--size", 2, a->size_px,
                 "width and height in pixels (default: the file's, or twice the principal point)");
  command.on_run([a] { run(*a); });
}

}  // namespace mf
