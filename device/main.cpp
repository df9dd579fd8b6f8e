// SPDX-License-Identifier: Apache-2.0
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <ctime>

#include "common/command_line/command_line.h"
#include "common/error.h"
#include "common/json_file.h"
#include "device/aravis_source.h"
#include "device/capture.h"
#include "device/config.h"

namespace {

std::atomic<bool> stop = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may set it");

void on_signal(int /*signal*/) {
  stop = true;
}

struct Arguments {
  std::filesystem::path config = "/etc/mirrorfield/mirrorfieldd.toml";
  std::filesystem::path output;
  double seconds = 0;
  bool list = false;
};

void list_cameras() {
  const std::vector<mf::FoundCamera> found = mf::find_aravis_cameras();
  for (const mf::FoundCamera& c : found)
    fmt::print("{:<32} {:<16} {} {} ({})\n", c.name, c.address, c.vendor, c.model, c.serial);
  if (found.empty()) fmt::print("no camera answers\n");
}

mf::SessionHeader header_of(const mf::DeviceConfig& config) {
  mf::SessionHeader header;
  header.black_level_hint = config.black_level_hint;
  header.mirror_reflectance = config.mirror_reflectance;
  header.target = mf::mirror_target_from_json(mf::read_json_file(config.target), config.target.string());
  if (config.world)
    header.world = mf::world_target_from_json(mf::read_json_file(*config.world), config.world->string());
  return header;
}

std::filesystem::path new_session(const mf::DeviceConfig& config) {
  return config.recordings / fmt::format("{:%Y%m%d-%H%M%S}", fmt::gmtime(std::time(nullptr)));
}

void show(const mf::RecorderStatus& s) {
  fmt::print(stderr, "\r{} frames durable, {} lost in {} gaps, queue {}  ", s.durable, s.lost, s.gaps, s.queued);
}

void record(const Arguments& a) {
  const mf::DeviceConfig config = mf::read_device_config(a.config);
  const std::filesystem::path session = a.output.empty() ? new_session(config) : a.output;
  mf::CaptureOptions options;
  options.recorder = config.recorder;
  options.most_seconds = a.seconds;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  const bool person = isatty(STDERR_FILENO) != 0;
  const mf::CaptureResult r =
      mf::capture([&] { return mf::open_aravis_source(config.camera); }, session, header_of(config), options, stop,
                  person ? show : std::function<void(const mf::RecorderStatus&)>());
  fmt::print("{}{}: {} frames of {} x {} {} in {:.1f} s, {} lost in {} gaps\n", person ? "\n" : "", session.string(),
             r.recorder.durable, r.camera.width, r.camera.height, mf::pixel_format_name(r.camera.format), r.seconds,
             r.recorder.lost, r.recorder.gaps);
  if (r.recorder.failure)
    throw mf::InputError(session.string(), "", "the recording stopped early: " + *r.recorder.failure);
}

}  // namespace

int main(int argc, char** argv) {
  mf::CommandLine program("mirrorfieldd",
                          "Records a mirror capture from a GigE Vision or USB3 Vision camera until it is told to stop "
                          "(SIGINT, SIGTERM).",
                          MIRRORFIELD_VERSION);
  Arguments arguments;
  program.option("--config", arguments.config, "what the rig is (docs/rig.md)");
  program.option("-o,--output", arguments.output, "the session to make (default: a new one in the config's folder)");
  program.option("--seconds", arguments.seconds, "stop by itself after so long; 0: don't");
  program.flag("--list", arguments.list, "show the cameras that answer, and record nothing");
  program.on_run([&] { arguments.list ? list_cameras() : record(arguments); });
  return program.run(argc, argv);
}
