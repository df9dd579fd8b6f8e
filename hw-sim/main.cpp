// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "hw-sim/capture.h"

namespace {

constexpr int exit_bad_input = 1;
constexpr int exit_usage = 2;

void show_progress(std::string_view stage, double fraction) {
  fmt::print(stderr, "\r{:<8} {:3.0f} %", stage, 100 * fraction);
  if (fraction >= 1) fmt::print(stderr, "\r{:20}\r", "");
}

int run(int argc, char** argv) {
  CLI::App program{
      "Simulates a mirror capture by ray tracing and writes it, truth included, in the format that "
      "`mirrorfield import` reads."};
  program.name("mirrorfield-sim");
  mf::sim::CaptureOptions options;
  std::filesystem::path out;
  program.add_option("-o,--out", out, "folder to create")->required();
  program.add_option("--frames", options.frames, "frames of the waving mirror")->capture_default_str();
  program.add_option("--size", options.size, "edge of a frame, pixels")->capture_default_str();
  program.add_option("--seed", options.seed, "same seed, same bytes")->capture_default_str();
  program.add_option("--samples", options.samples, "light paths a pixel in frames")->capture_default_str();
  program.add_option("--truth-samples", options.truth_samples, "light paths a pixel in truth pictures")
      ->capture_default_str();
  program.add_option("--views", options.views, "truth pictures with and without the object")->capture_default_str();
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return program.exit(e) == 0 ? 0 : exit_usage;
  }
  const auto start = std::chrono::steady_clock::now();
  mf::sim::write_capture(out, options, isatty(STDERR_FILENO) != 0 ? show_progress : mf::Progress{});
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  fmt::print("{}: {} frames of {} x {} and their truth in {:.1f} s\n", out.string(), options.frames, options.size,
             options.size, elapsed.count());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "mirrorfield-sim: {}\n", e.what());
  }
  return exit_bad_input;
}
