// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "common/error.h"
#include "common/response_curve.h"
#include "common/seconds_since.h"
#include "common/session.h"
#include "host/calibration/calibrate.h"
#include "host/calibration/colmap_export.h"
#include "host/calibration/session_targets.h"
#include "host/cli/command.h"
#include "host/cli/session_files.h"

namespace mf {

namespace {

struct CalibrateArguments {
  std::filesystem::path session;
  std::filesystem::path colmap;
  std::string distortion = "automatic";
  CalibrationOptions options;
  bool json = false;
};

nlohmann::json summary_of(const CalibrationResult& result) {
  const Calibration& c = result.calibration;
  nlohmann::json unposed = nlohmann::json::array();
  for (const MirrorPose& frame : c.frames)
    if (!frame.used) unposed.push_back({{"name", frame.name}, {"why_not", frame.why_not}});
  static constexpr std::array<const char*, CameraModel::parameter_count> names{"fx", "fy", "cx", "cy", "k1",
                                                                               "k2", "p1", "p2", "k3"};
  nlohmann::json parameters, sigma;
  for (std::size_t i = 0; i < names.size(); ++i) {
    parameters[names[i]] = c.camera.parameters[i];
    sigma[names[i]] = c.camera_sigma[i];
  }
  nlohmann::json json{{"frames", c.frames.size()},
                      {"used", c.frames.size() - unposed.size()},
                      {"rms_px", c.rms_px},
                      {"camera", parameters},
                      {"sigma", sigma},
                      {"K", {{c.camera.fx(), 0, c.camera.cx()}, {0, c.camera.fy(), c.camera.cy()}, {0, 0, 1}}},
                      {"tags", result.tags},
                      {"outlier_tags", result.outlier_tags},
                      {"noise_factor", result.noise_factor},
                      {"unposed", unposed}};
  if (c.cam_from_world) json["world_rms_px"] = c.world_rms_px;
  return json;
}

std::string text_of(const CalibrationResult& result, const nlohmann::json& summary) {
  const Calibration& c = result.calibration;
  std::string text =
      fmt::format("{} of {} frames posed; {} tags, {} of them outliers; reprojection {:.3f} px RMS\n",
                  summary["used"].get<int>(), c.frames.size(), result.tags, result.outlier_tags, c.rms_px);
  text += fmt::format("fx {:.2f} ± {:.2f}  fy {:.2f} ± {:.2f}  cx {:.2f} ± {:.2f}  cy {:.2f} ± {:.2f}\n", c.camera.fx(),
                      c.camera_sigma[0], c.camera.fy(), c.camera_sigma[1], c.camera.cx(), c.camera_sigma[2],
                      c.camera.cy(), c.camera_sigma[3]);
  if (c.camera.has_distortion())
    text += fmt::format("k1 {:.5f}  k2 {:.5f}  p1 {:.6f}  p2 {:.6f}  k3 {:.5f}\n", c.camera.parameters[4],
                        c.camera.parameters[5], c.camera.parameters[6], c.camera.parameters[7], c.camera.parameters[8]);
  else
    text += "no lens distortion that the pictures show\n";
  text += c.cam_from_world ? fmt::format("world frame: {:.3f} px RMS\n", c.world_rms_px)
                           : "no world frame: no scene picture shows the world's tags\n";
  for (const nlohmann::json& frame : summary["unposed"])
    text += fmt::format("not used: {}: {}\n", frame["name"].get<std::string>(), frame["why_not"].get<std::string>());
  return text;
}

void run(CalibrateArguments& arguments) {
  const std::optional<DistortionChoice> distortion = parse_distortion_choice(arguments.distortion);
  if (!distortion)
    throw InputError("calibrate", "--distortion",
                     "'" + arguments.distortion + "' is none: use automatic, none, radial, brown or full");
  arguments.options.distortion = *distortion;
  if (const std::optional<std::string> fault = arguments.options.validate()) throw InputError("options", "", *fault);
  const Progress progress = progress_bar();
  const SessionReader session = open_session(arguments.session);
  const ResponseCurve response = response_of(session);
  auto start = std::chrono::steady_clock::now();
  const CalibrationInput input =
      find_session_targets(session, response, TagSearchOptions{}, arguments.options.threads, progress);
  const double seconds_finding = seconds_since(start);
  start = std::chrono::steady_clock::now();
  const CalibrationResult result = calibrate(input, arguments.options, progress);
  const double seconds_calibrating = seconds_since(start);
  write_calibration(session.folder() / "calibration.json", result.calibration);
  nlohmann::json summary = summary_of(result);
  summary["seconds"] = {{"finding tags", seconds_finding}, {"calibrating", seconds_calibrating}};
  std::string text = text_of(result, summary);
  if (!arguments.colmap.empty()) {
    start = std::chrono::steady_clock::now();
    const ColmapSummary exported = export_colmap(arguments.colmap, result.calibration, session, response, progress);
    summary["seconds"]["exporting"] = seconds_since(start);
    summary["colmap_images"] = exported.images;
    text += fmt::format("{}: COLMAP model of {} views\n", arguments.colmap.string(), exported.images);
  }
  print_summary(arguments.json, summary, text);
}

}  // namespace

void add_calibrate_command(CommandLine& program) {
  CommandLine command = program.command(
      "calibrate", "the camera, the mirror's pose in every frame and the world frame, from tags: calibration.json");
  // Shared: the callback outlives this function.
  auto arguments = std::make_shared<CalibrateArguments>();
  command.option("session", arguments->session, "the session's folder, with response.json", Presence::required);
  command.option("--export-colmap", arguments->colmap, "also write a COLMAP text model with its pictures here");
  command.option("--distortion", arguments->distortion,
                 "lens terms to estimate: automatic (what the pictures show), none, radial (k1 k2), brown (k1 k2 p1 "
                 "p2), full (and k3)");
  command.flag("--square-pixels", arguments->options.square_pixels, "fx = fy");
  command.option("--max-rotation-sigma-deg", arguments->options.max_rotation_sigma_deg,
                 "a frame less certain than this is not used");
  command.option("--max-position-sigma-m", arguments->options.max_position_sigma_m,
                 "a frame less certain than this is not used");
  command.option("--threads", arguments->options.threads, "0: as many as the machine has");
  add_json_flag(command, arguments->json);
  command.on_run([arguments] { run(*arguments); });
}

}  // namespace mf
