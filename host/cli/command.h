// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/command_line/command_line.h"
#include "common/progress.h"

namespace mf {

// Each command adds itself to the program: its flags, and a callback that runs it. One file a command.
void add_import_command(CommandLine& program);
void add_photometry_command(CommandLine& program);
void add_calibrate_command(CommandLine& program);
void add_resample_command(CommandLine& program);
void add_plate_command(CommandLine& program);
void add_probe_command(CommandLine& program);
void add_render_command(CommandLine& program);
void add_composite_command(CommandLine& program);
void add_lumigraph_command(CommandLine& program);
void add_process_command(CommandLine& program);
void add_view_command(CommandLine& program);

// The flag that every command has: print what was measured as JSON on standard output, and nothing else there.
void add_json_flag(CommandLine& command, bool& json);

// Prints `summary` as JSON (json) or `text` for people.
void print_summary(bool json, const nlohmann::json& summary, const std::string& text);

// For before the work: throws InputError when the folder that `output` goes to does not exist.
void check_folder_of(const std::filesystem::path& output);
// That, and an ending other than .exr: what is written is EXR whatever its name.
void check_exr_output(const std::string& command, const std::string& flag, const std::filesystem::path& output);

// A progress bar on standard error; it appears when work takes longer than two seconds, and only on a terminal.
[[nodiscard]] Progress progress_bar();

}  // namespace mf
