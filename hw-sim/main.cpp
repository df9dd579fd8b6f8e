// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <thread>
#include <vector>

#include "common/command_line/command_line.h"
#include "common/error.h"
#include "hw-sim/capture.h"
#include "hw-sim/scenario_run.h"
#include "hw-sim/session_camera.h"
#include "hw-sim/v4l2_camera.h"

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

struct CameraArguments {
  std::filesystem::path session;
  mf::sim::PlayOptions play;
  double linger_s = 2;
};

void check_camera(const CameraArguments& a) {
  const mf::sim::GigeCameraOptions& o = a.play.camera;
  if (!(o.frame_rate_hz > 0 && o.frame_rate_hz <= 1000))
    throw mf::InputError("camera", "--rate", "must lie above 0, up to 1000");
  if (!(o.packet_loss >= 0 && o.packet_loss < 1))
    throw mf::InputError("camera", "--loss", "must lie from 0 to below 1");
  if (a.play.times < 0) throw mf::InputError("camera", "--times", "must not be negative");
}

// Answers until everything was sent and could be asked for again, or for ever.
void play(const CameraArguments& a) {
  const mf::sim::SessionCamera camera(a.session, a.play);
  const mf::sim::GigeCameraOptions& o = camera.options();
  fmt::print("{}: {} x {} {} at {} frames a second, waiting for a client\n", o.address, o.width, o.height,
             o.format.name, o.frame_rate_hz);
  std::fflush(stdout);
  while (!camera.finished()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  std::this_thread::sleep_for(std::chrono::duration<double>(a.linger_s));
  const mf::sim::GigeCameraCounts c = camera.counts();
  fmt::print("{} frames in {} packets, {} of them dropped; {} sent again\n", c.frames, c.packets, c.dropped, c.resent);
}

void add_capture_command(mf::CommandLine& program, mf::sim::CaptureOptions& options, std::filesystem::path& out) {
  mf::CommandLine command = program.command(
      "capture",
      "ray trace a mirror capture and write it, truth included, in the format that `mirrorfield import` reads");
  command.option("-o,--out", out, "folder to create", mf::Presence::required);
  command.option("--frames", options.frames, "frames of the waving mirror");
  command.option("--size", options.size, "edge of a frame, pixels");
  command.option("--seed", options.seed, "same seed, same bytes");
  command.option("--samples", options.samples, "light paths a pixel in frames");
  command.option("--truth-samples", options.truth_samples, "light paths a pixel in truth pictures");
  command.option("--views", options.views, "truth pictures with and without the object");
  command.on_run([&] { simulate(out, options); });
}

void add_camera_command(mf::CommandLine& program, CameraArguments& a) {
  mf::CommandLine command = program.command("camera", "play a session's mirror frames as a GigE Vision camera");
  command.option("session", a.session, "session whose frames are sent", mf::Presence::required);
  command.option("--address", a.play.camera.address,
                 "of this machine: a loopback address keeps every packet on this machine");
  command.option("--rate", a.play.camera.frame_rate_hz, "frames a second");
  command.option("--loss", a.play.camera.packet_loss, "share of the packets that get lost at first, 0 to below 1");
  command.option("--seed", a.play.camera.seed, "of the losses");
  command.option("--times", a.play.times, "how often the recording is played; 0: for ever");
  command.option("--linger", a.linger_s, "seconds in which it answers after the last frame");
  command.on_run([&a] {
    check_camera(a);
    play(a);
  });
}

struct PlayArguments {
  std::filesystem::path scenario;
  std::filesystem::path out = "scenario";
};

// The button is an input device below umockdev: this program and the daemon look for it through its library.
void run_with_umockdev(char** argv) {
  if (mf::sim::has_umockdev()) return;
  const char* given = std::getenv("LD_PRELOAD");
  if (given != nullptr && std::string_view(given).find(mf::sim::umockdev_library) != std::string_view::npos)
    throw mf::InputError(mf::sim::umockdev_library, "", "cannot be preloaded: install the package umockdev");
  ::setenv("LD_PRELOAD", mf::sim::umockdev_library, 1);
  ::execv("/proc/self/exe", argv);
  throw mf::InputError("mirrorfield-sim", "", "cannot start itself again");
}

void play_scenario(const PlayArguments& a) {
  const mf::sim::Scenario scenario = mf::sim::read_scenario(a.scenario);
  const auto start = std::chrono::steady_clock::now();
  const auto say = [&](const std::string& what) {
    const std::chrono::duration<double> since = std::chrono::steady_clock::now() - start;
    fmt::print("{:7.2f} s  {}\n", since.count(), what);
    std::fflush(stdout);
  };
  const std::filesystem::path daemon = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "mirrorfieldd";
  const mf::sim::ScenarioResult r =
      run_scenario(scenario, {a.out, daemon}, isatty(STDERR_FILENO) != 0 ? show_progress : mf::Progress{}, say);
  fmt::print("{}: {} frames, {} missing in {} gaps; the first durable {:.2f} s after the press\n", r.session.string(),
             r.last.durable_frames, r.last.lost_frames, r.last.gaps, r.first_durable_s);
  if (r.daemon_exit_code != 0)
    throw mf::InputError("mirrorfieldd", "", fmt::format("ended with exit code {}", r.daemon_exit_code));
}

void add_play_command(mf::CommandLine& program, PlayArguments& a, char** argv) {
  mf::CommandLine command = program.command(
      "play",
      "start camera, button and daemon after a scenario, and record; `mirrorfield-sim FILE.toml` is short for it");
  command.option("scenario", a.scenario, "TOML (docs/simulator.md)", mf::Presence::required);
  command.option("-o,--out", a.out, "folder to create: the session, and truth/ beside it");
  command.on_run([&a, argv] {
    run_with_umockdev(argv);
    play_scenario(a);
  });
}

}  // namespace

int main(int argc, char** argv) {
  mf::CommandLine program("mirrorfield-sim",
                          "The rig without hardware: captures by ray tracing, and a camera that plays them.");
  mf::sim::CaptureOptions options;
  std::filesystem::path out;
  CameraArguments camera;
  add_capture_command(program, options, out);
  PlayArguments play;
  add_camera_command(program, camera);
  add_play_command(program, play, argv);
  std::vector<char*> words(argv, argv + argc);
  std::string command = "play";
  if (argc > 1 && std::string_view(argv[1]).ends_with(".toml")) words.insert(words.begin() + 1, command.data());
  return program.run(static_cast<int>(words.size()), words.data());
}
