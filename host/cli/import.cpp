// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "host/cli/command.h"
#include "host/import/import_session.h"

namespace mf {

namespace {

struct ImportArguments {
  ImportInput input;
  ImportOptions options;
  bool json = false;
};

void run(const ImportArguments& arguments) {
  const ImportResult result = import_session(arguments.input, arguments.options, progress_bar());
  const std::string format = pixel_format_name(result.format);
  const nlohmann::json summary{{"session", arguments.options.session.string()},
                               {"pixel_format", format},
                               {"width", result.width},
                               {"height", result.height},
                               {"mirror_frames", result.mirror_frames},
                               {"scene_frames", result.scene_frames},
                               {"sweep_frames", result.sweep_frames},
                               {"scene_exposure_s", result.scene_exposure_s},
                               {"unlisted_files", result.unlisted_files},
                               {"source_bytes", result.source_bytes},
                               {"session_bytes", result.session_bytes}};
  std::string text =
      fmt::format("{}: {} mirror frames, {} scene, {} sweep; {} x {} {}; {:.1f} MB\n",
                  arguments.options.session.string(), result.mirror_frames, result.scene_frames, result.sweep_frames,
                  result.width, result.height, format, static_cast<double>(result.session_bytes) / 1e6);
  if (result.unlisted_files > 0)
    text += fmt::format("left out: {} files in frames/ that frames.json does not list\n", result.unlisted_files);
  print_summary(arguments.json, summary, text);
}

}  // namespace

void add_import_command(CommandLine& program) {
  CommandLine command = program.command("import", "frames of any camera, with target and exposures, into a session");
  // Shared: the callback outlives this function.
  auto arguments = std::make_shared<ImportArguments>();
  command.option("folder", arguments->input.folder, "folder in the import format (docs/import.md)", Presence::required);
  command.option("-o,--output", arguments->options.session, "the session's folder to make", Presence::required);
  command.flag("--overwrite", arguments->options.overwrite, "replace the output when it is a session already");
  add_json_flag(command, arguments->json);
  command.on_run([arguments] { run(*arguments); });
}

}  // namespace mf
