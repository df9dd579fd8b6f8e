// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "common/error.h"
#include "host/cli/command.h"

namespace {

constexpr int exit_bad_input = 1;
constexpr int exit_usage = 2;

int run(int argc, char** argv) {
  CLI::App program{
      "Mirrorfield: captures the light of a real place with a camera and a hand-held mirror, and lights virtual "
      "objects with it."};
  program.name("mirrorfield");
  program.require_subcommand(1);
  program.set_version_flag("--version", MIRRORFIELD_VERSION);
  mf::add_import_command(program);
  mf::add_photometry_command(program);
  mf::add_calibrate_command(program);
  mf::add_resample_command(program);
  mf::add_probe_command(program);
  mf::add_render_command(program);
  mf::add_composite_command(program);
  mf::add_process_command(program);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return program.exit(e) == 0 ? 0 : exit_usage;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "mirrorfield: {}\n", e.what());
  }
  return exit_bad_input;
}
