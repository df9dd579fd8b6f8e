// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/seconds_since.h"
#include "host/cli/command.h"
#include "host/cli/peak_memory.h"
#include "host/cli/run_resample.h"
#include "host/cli/session_views.h"

namespace mf {

namespace {

struct ResampleArguments {
  std::filesystem::path session;
  std::filesystem::path output;
  ResampleOptions options;
  std::vector<double> rectangle;
  int threads = 0;
  std::filesystem::path provenance;
  bool no_fill = false;
  bool json = false;
};

nlohmann::json emitters_json(const std::vector<ShadedEmitter>& emitters) {
  nlohmann::json all = nlohmann::json::array();
  for (const ShadedEmitter& e : emitters) {
    const Eigen::Vector3f& at = e.emitter.position;
    all.push_back({{"at_m", {at.x(), at.y(), at.z()}},
                   {"radius_m", e.emitter.radius_m},
                   {"radiance", {e.radiance.x(), e.radiance.y(), e.radiance.z()}},
                   {"views", e.emitter.views}});
  }
  return all;
}

nlohmann::json summarize(const ResampleResult& r) {
  nlohmann::json scores = nlohmann::json::array();
  for (const SphereScore& s : r.sphere_scores)
    scores.push_back({{"radius_m", std::isinf(s.radius_m) ? nlohmann::json("inf") : nlohmann::json(s.radius_m)},
                      {"inconsistency_stops", s.inconsistency}});
  const PlaneRectangle& plane = r.field.plane;
  return {{"proxy", surroundings_name(r.field.surroundings)},
          {"sphere_scores", scores},
          {"directions", r.field.directions.size()},
          {"size", r.field.resolution},
          {"views", r.views},
          {"rectangle_m", {plane.min_m.x(), plane.min_m.y(), plane.max_m.x(), plane.max_m.y()}},
          {"height_m", plane.world_from_plane.translation.z()},
          {"mean_confidence", r.mean_confidence},
          {"filled_share", r.filled_share},
          {"emitters", emitters_json(r.field.emitters)},
          {"seconds", r.seconds},
          {"peak_memory_bytes", peak_memory_bytes()}};
}

void run(ResampleArguments& a) {
  if (a.threads < 0)
    throw InputError("resample", "--threads", "must be a number of threads (0: as many as processors)");
  check_exr_output("resample", "--output", a.output);
  if (!a.provenance.empty()) check_exr_output("resample", "--provenance", a.provenance);
  if (!a.rectangle.empty())
    a.options.rectangle = std::array<double, 4>{a.rectangle[0], a.rectangle[1], a.rectangle[2], a.rectangle[3]};
  a.options.fill = !a.no_fill;
  a.options.provenance = !a.provenance.empty();
  std::optional<tbb::global_control> limit;
  if (a.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(a.threads));
  Team team = Team::join();
  const ResampleResult r =
      run_resample(a.session, a.output, a.options, team, team.rank() == 0 ? progress_bar() : Progress());
  if (team.rank() > 0) return;
  if (r.provenance) write_provenance(a.provenance, *r.provenance);
  const Eigen::Vector2d size = r.field.plane.size_m();
  print_summary(
      a.json, summarize(r),
      fmt::format(
          "{} views → {} directions × {}² texels over {:.2f} × {:.2f} m, proxy {}, mean confidence {:.2f}\n{}\n",
          r.views, r.field.directions.size(), r.field.resolution, size.x(), size.y(),
          surroundings_name(r.field.surroundings), r.mean_confidence, a.output.string()));
}

}  // namespace

ResampleResult run_resample(const std::filesystem::path& folder, const std::filesystem::path& output,
                            const ResampleOptions& options, Team& team, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  const SessionViews session = load_session_views("resample", folder, options, team, progress);
  const double loading = seconds_since(start);
  Resampling resampling(session.views, session.rectangle, options, team, progress);
  ResampleResult result = resample_to_file(resampling, output, session.absolute, team, progress);
  if (options.provenance && team.rank() == 0) result.provenance = resampling.provenance(session.frame_names);
  result.seconds["loading"] = loading;
  result.seconds["total"] = seconds_since(start);
  return result;
}

void add_resample_command(CommandLine& program) {
  CommandLine command =
      program.command("resample", "resample a calibrated session into an incident light field (.lf.exr)");
  const auto a = std::make_shared<ResampleArguments>();  // shared: the parser's callback outlives this function
  command.option("session", a->session, "session folder with response.json and calibration.json", Presence::required);
  command.option("-o,--output", a->output, "light field to write, NAME.lf.exr", Presence::required);
  command.option("--height", a->options.height_m, "height of the light-field plane above the world's ground, metres");
  command.option("--directions", a->options.directions, "at least so many directions over the hemisphere");
  command.option("--size", a->options.size, "texels along each side of the plane's rectangle");
  command.option("--proxy", a->options.proxy,
                 "what the views are focused on: auto (a distance per direction), sphere (the best radius), sphere:R "
                 "(metres), sphere:inf, box (the best room), box:X0,Y0,X1,Y1,H (world metres), mesh:FILE (world "
                 "coordinates), plane");
  command.option("-k", a->options.k, "views blended for a ray (0: 15 for the plane, 6 else)");
  command.option("--resolution", a->options.resolution,
                 "beta: metres of ray distance that an octave of missing resolution counts for");
  command.option("--border", a->options.border, "gamma: how strongly views are shunned near the mirror's edge");
  command.flag("--no-fill", a->no_fill, "leave what no view saw black instead of guessing it from around");
  command.option("--provenance", a->provenance, "also write which frames lit which texels (EXR), for 'probe --why'");
  command.values("--rectangle", 4, a->rectangle,
                 "x0 y0 x1 y1 of the plane's rectangle, world metres (default: where the mirror swept)");
  command.option("--threads", a->threads, "threads of this process (0: as many as processors)");
  add_json_flag(command, a->json);
  command.on_run([a] { run(*a); });
}

}  // namespace mf
