// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/atomic_file.h"
#include "common/error.h"
#include "common/json_file.h"
#include "common/seconds_since.h"
#include "common/session.h"
#include "host/calibration/calibrate.h"
#include "host/calibration/session_targets.h"
#include "host/cli/command.h"
#include "host/cli/run_resample.h"
#include "host/cli/session_files.h"
#include "host/io/exr.h"
#include "host/io/image_file.h"
#include "host/light_field/probe.h"
#include "host/photometry/photometry.h"
#include "host/report/field_pictures.h"
#include "host/report/report.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

constexpr double probe_height_m = 0.1;  // above the plane's middle: where a small object's own middle would be
constexpr int probe_width_px = 1024;

struct ProcessArguments {
  fs::path session;
  fs::path output;
  PhotometryOptions photometry;
  CalibrationOptions calibration;
  ResampleOptions resample;
  bool json = false;
};

// Runs a stage and notes how long it took.
template <typename Stage>
auto timed(std::map<std::string, double>& seconds, const std::string& name, const Stage& stage) {
  const auto start = std::chrono::steady_clock::now();
  auto result = stage();
  seconds[name] = seconds_since(start);
  return result;
}

// A rig that knows its camera's response brings response.json along, instead of a sweep.
ResponseCurve estimate_response(const SessionReader& session, const PhotometryOptions& options,
                                const Progress& progress) {
  if (!options.linear && session.frames(FrameRole::sweep).empty() && fs::exists(session.folder() / "response.json"))
    return response_of(session);
  const PhotometryResult result = photometry(session, options, progress);
  write_json_file(session.folder() / "response.json", response_json(result, options));
  return result.curve;
}

Calibration estimate_calibration(const SessionReader& session, const ResponseCurve& response,
                                 const CalibrationOptions& options, const Progress& progress) {
  const CalibrationInput input = find_session_targets(session, response, {}, options.threads, progress);
  CalibrationResult result = calibrate(input, options, progress);
  write_calibration(session.folder() / "calibration.json", result.calibration);
  return std::move(result.calibration);
}

// The point over the middle of the plane's rectangle where the report takes its probe.
Eigen::Vector3d probe_point(const PlaneRectangle& plane) {
  const Eigen::Vector2d middle = 0.5 * (plane.min_m + plane.max_m);
  return plane.world_from_plane * Eigen::Vector3d(middle.x(), middle.y(), probe_height_m);
}

void write_probe(const fs::path& folder, const Probe& probe, const Eigen::Vector3d& at) {
  ExrOptions options;
  options.latlong = true;
  options.attributes = {{"mfConsumer", "openexr"}, {"mfAt", fmt::format("{} {} {}", at.x(), at.y(), at.z())}};
  write_exr(folder / "probe.exr", probe.radiance, options);
  write_png(folder / "probe.png", to_srgb8(probe.radiance, display_exposure(probe.radiance)));
}

std::size_t used_frames(const Calibration& calibration) {
  return static_cast<std::size_t>(std::count_if(calibration.frames.begin(), calibration.frames.end(),
                                                [](const MirrorPose& pose) { return pose.used; }));
}

void check_options(const ProcessArguments& a) {
  for (const auto& problem : {a.photometry.validate(), a.calibration.validate(), a.resample.validate()})
    if (problem) throw InputError("process", "options", *problem);
}

void create_output_folder(const ProcessArguments& a) {
  std::error_code error;
  fs::create_directories(a.output, error);
  if (error) throw InputError(a.output.string(), "", "cannot be created: " + error.message());
}

void run(const ProcessArguments& a) {
  check_options(a);
  const SessionReader session = open_session(a.session);
  create_output_folder(a);
  const Progress progress = progress_bar();
  std::map<std::string, double> seconds;
  const ResponseCurve response =
      timed(seconds, "photometry", [&] { return estimate_response(session, a.photometry, progress); });
  const Calibration calibration =
      timed(seconds, "calibrate", [&] { return estimate_calibration(session, response, a.calibration, progress); });
  const fs::path field_file = a.output / "field.lf.exr";
  Team alone;
  timed(seconds, "resample", [&] { return run_resample(a.session, field_file, a.resample, alone, progress); });
  const LightField field = read_light_field(field_file);
  const Eigen::Vector3d at = probe_point(field.plane);
  const Probe probe =
      timed(seconds, "probe", [&] { return make_probe(field, at, LatLongConvention::openexr, probe_width_px); });
  write_probe(a.output, probe, at);
  const std::string name = fs::absolute(a.session).lexically_normal().filename().string();
  write_file_atomically(a.output / "report.html", report_html({"Mirrorfield report: " + name, session, response,
                                                               calibration, field, probe.radiance, at, seconds},
                                                              progress));
  const std::size_t used = used_frames(calibration);
  const double covered = covered_share(field);
  print_summary(a.json,
                {{"frames", calibration.frames.size()},
                 {"used", used},
                 {"rms_px", calibration.rms_px},
                 {"directions", field.directions.size()},
                 {"size", field.resolution},
                 {"covered_share", covered},
                 {"absolute", response.absolute},
                 {"seconds", seconds},
                 {"output", a.output.string()}},
                fmt::format("{} of {} frames posed, {:.3f} px; {:.0f} % of the directions seen\n"
                            "{}: field.lf.exr, probe.exr, probe.png, report.html\n",
                            used, calibration.frames.size(), calibration.rms_px, 100 * covered, a.output.string()));
}

}  // namespace

void add_process_command(CommandLine& program) {
  CommandLine command = program.command(
      "process", "photometry, calibration, light field and probe of a session in one go, and a report (report.html)");
  const auto a = std::make_shared<ProcessArguments>();  // shared: the parser's callback outlives this function
  command.option("session", a->session, "session folder; response.json and calibration.json are written there",
                 Presence::required);
  command.option("-o,--output", a->output, "folder for the results", Presence::required);
  command.flag("--linear", a->photometry.linear,
               "use no exposure sweep: the sensor is linear from the black level to its last code");
  command.option("--height", a->resample.height_m, "height of the light-field plane above the world's ground, metres");
  command.option("--directions", a->resample.directions, "at least so many directions over the hemisphere");
  command.option("--size", a->resample.size, "texels along each side of the plane's rectangle");
  command.option("--proxy", a->resample.proxy, "what the views are focused on, as for `resample`");
  add_json_flag(command, a->json);
  command.on_run([a] { run(*a); });
}

}  // namespace mf
