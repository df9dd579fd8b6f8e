// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>

#include "common/command_line/command_line.h"
#include "hw-sim/capture.h"

namespace {

void show_progress(std::string_view stage, double fraction) {
  fmt::print(stderr, "\r{:<8} {:3.0f} %", stage, 100 * fraction);
  if (fraction >= 1) fmt::print(stderr, "\r{:20}\r", "");
}

void simulate(const std::filesystem::path& out, const mf::sim::CaptureOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  mf::sim::write_capture(out, options, isatty(STDERR_FILENO) != 0 ? show_progress : mf::Progress{});
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  fmt::print("{}: {} frames of {} x {} and their truth in {:.1f} s\n", out.string(), options.frames, options.size,
             options.size, elapsed.count());
}

}  // namespace

int main(int argc, char** argv) {
  mf::CommandLine program("mirrorfield-sim",
                          "Simulates a mirror capture by ray tracing and writes it, truth included, in the format that "
                          "`mirrorfield import` reads.");
  mf::sim::CaptureOptions options;
  std::filesystem::path out;
  program.option("-o,--out", out, "folder to create", mf::Presence::required);
  program.option("--frames", options.frames, "frames of the waving mirror");
  program.option("--size", options.size, "edge of a frame, pixels");
  program.option("--seed", options.seed, "same seed, same bytes");
  program.option("--samples", options.samples, "light paths a pixel in frames");
  program.option("--truth-samples", options.truth_samples, "light paths a pixel in truth pictures");
  program.option("--views", options.views, "truth pictures with and without the object");
  program.on_run([&] { simulate(out, options); });
  return program.run(argc, argv);
}
