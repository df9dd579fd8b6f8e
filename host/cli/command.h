// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include "common/progress.h"

namespace mf {

// Each command adds itself to the program: its flags, and a callback that runs it. One file a command.
void add_import_command(CLI::App& program);
void add_photometry_command(CLI::App& program);
void add_calibrate_command(CLI::App& program);
void add_resample_command(CLI::App& program);
void add_probe_command(CLI::App& program);
void add_render_command(CLI::App& program);
void add_composite_command(CLI::App& program);
void add_process_command(CLI::App& program);

// The flag that every command has: print what was measured as JSON on standard output, and nothing else there.
void add_json_flag(CLI::App& command, bool& json);

// Prints `summary` as JSON (json) or `text` for people.
void print_summary(bool json, const nlohmann::json& summary, const std::string& text);

// A progress bar on standard error; it appears when work takes longer than two seconds, and only on a terminal.
[[nodiscard]] Progress progress_bar();

}  // namespace mf
