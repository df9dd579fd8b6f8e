// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/photometry.h"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "common/json_file.h"
#include "host/cli/command.h"
#include "host/cli/session_files.h"

namespace mf {

namespace {

struct PhotometryArguments {
  std::filesystem::path session;
  std::filesystem::path output;
  PhotometryOptions options;
  bool json = false;
};

void run(const PhotometryArguments& arguments) {
  const SessionReader session = open_session(arguments.session);
  const PhotometryResult result = photometry(session, arguments.options, progress_bar());
  const std::filesystem::path output =
      arguments.output.empty() ? arguments.session / "response.json" : arguments.output;
  write_json_file(output, response_json(result, arguments.options));
  nlohmann::json summary = photometry_summary(result);
  summary["output"] = output.string();
  print_summary(arguments.json, summary, photometry_text(result) + fmt::format("wrote {}\n", output.string()));
}

}  // namespace

void add_photometry_command(CommandLine& program) {
  const auto arguments = std::make_shared<PhotometryArguments>();  // lives as long as the callback
  CommandLine command = program.command(
      "photometry", "estimate the sensor's response from the session's exposure sweep and write response.json");
  ResponseOptions& response = arguments->options.response;
  command.option("session", arguments->session, "the session's folder", Presence::required);
  command.option("-o,--output", arguments->output, "where to write (SESSION/response.json)");
  command.flag("--linear", arguments->options.linear,
               "use no sweep: the sensor is linear from the black level to its last code");
  command.option("--pixels", response.pixels, "pixels of each channel that the fit looks at");
  command.option("--knot_step,--knot-step", response.knot_step, "between the curve's knots, in ln(exposure)");
  command.option("--kink_scale,--kink-scale", response.kink_scale,
                 "change of slope from knot to knot that counts as none");
  command.option("--outlier_sigmas,--outlier-sigmas", response.outlier_sigmas, "readings off by more lose their say");
  command.option("--max_iterations,--max-iterations", response.max_iterations, "of Gauss-Newton");
  command.option("--noise_limit,--noise-limit", response.noise_limit,
                 "self-consistency counts readings less noisy than this");
  add_json_flag(command, arguments->json);
  command.on_run([arguments] { run(*arguments); });
}

}  // namespace mf
