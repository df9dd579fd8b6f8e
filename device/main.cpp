// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <atomic>
#include <csignal>

#include "common/command_line/command_line.h"
#include "common/error.h"
#include "device/aravis_source.h"
#include "device/config.h"
#include "device/daemon.h"
#include "device/machine_check.h"
#include "device/replay.h"
#include "device/rig_status_json.h"
#include "device/v4l2_source.h"

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
  std::filesystem::path replay;
  bool record = false;
  bool list = false;
  bool check = false;
};

void list_cameras() {
  std::vector<mf::FoundCamera> found = mf::find_aravis_cameras();
  for (mf::FoundCamera& camera : mf::find_v4l2_cameras()) found.push_back(std::move(camera));
  for (const mf::FoundCamera& c : found)
    fmt::print("{:<32} {:<16} {} {} ({})\n", c.name, c.address, c.vendor, c.model, c.serial);
  if (found.empty()) fmt::print("no camera answers\n");
}

// What is wrong with this machine, if anything; an error among it is one of the program's.
void check(const Arguments& a) {
  std::vector<mf::Finding> findings{mf::check_config(a.config)};
  if (findings[0].level == mf::Finding::Level::ok) {
    const mf::DeviceConfig config = mf::read_device_config(a.config);
    for (mf::Finding& f : mf::check_machine(mf::machine_check_options(config))) findings.push_back(std::move(f));
    if (config.operating.button) findings.push_back(mf::check_button(*mf::open_start_button(*config.operating.button)));
    if (config.operating.hid_button)
      findings.push_back(mf::check_button(*mf::open_hid_button(*config.operating.hid_button)));
  }
  bool bad = false;
  for (const mf::Finding& f : findings) {
    fmt::print("{}\n", mf::finding_line(f));
    bad = bad || f.level == mf::Finding::Level::error;
  }
  if (bad) throw mf::InputError("this machine", "", "cannot record: mend the errors above");
}

// What detection finds in a recording, with this rig's settings when there is a config.
void replay_session(const Arguments& a) {
  mf::LookoutOptions options;
  if (std::filesystem::exists(a.config))
    if (const auto configured = mf::read_device_config(a.config).lookout) options = *configured;
  const mf::ReplayResult r = mf::replay(a.replay, options, [](const mf::ReplayedFrame& f) {
    fmt::print("{:>8} {:3} tags {:6.1f} ms{}\n", f.frame->info.name, f.detected->tags.size(), f.detected->milliseconds,
               f.posed ? "  posed" : "");
  });
  fmt::print("{}: {} of {} frames with tags ({:.0f} in the median one), {} posed, {:.1f} ms a frame{}\n",
             a.replay.string(), r.with_tags, r.frames, r.median_tags, r.posed, r.median_ms,
             r.covered ? fmt::format(", {:.0f} % of the light covered", 100 * *r.covered) : "");
  for (const std::string& line : r.damage) fmt::print(stderr, "warning: {}\n", line);
}

void show(const mf::RigStatus& s) {
  fmt::print(stderr, "\r{}: {} frames durable, {} lost in {} gaps, queue {} {}  ", mf::rig_state_name(s.state),
             s.durable_frames, s.lost_frames, s.gaps, s.queued, s.problem);
}

// A frame's memory comes and goes many times a second. Given back to the system, every page of it would be a fault
// anew.
void keep_memory() {
  constexpr int larger_than_a_frame = 64 << 20, most_kept = 64 << 20;
  mallopt(M_MMAP_THRESHOLD, larger_than_a_frame);
  mallopt(M_TRIM_THRESHOLD, most_kept);
}

void run(const Arguments& a) {
  keep_memory();
  const mf::DeviceConfig config = mf::read_device_config(a.config);
  mf::DaemonOptions options;
  options.record_now = a.record || !a.output.empty();
  if (!a.output.empty()) options.session = a.output;
  options.most_seconds = a.seconds;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  const bool person = isatty(STDERR_FILENO) != 0;
  const mf::RigStatus last =
      run_daemon(config, options, stop, person ? show : std::function<void(const mf::RigStatus&)>());
  if (!options.record_now) return;
  if (last.session.empty()) throw mf::InputError("mirrorfieldd", "", last.problem);
  fmt::print("{}{}: {} frames in {:.1f} s, {} lost in {} gaps\n", person ? "\n" : "", last.session, last.durable_frames,
             last.seconds, last.lost_frames, last.gaps);
  if (last.state == mf::RigState::error)
    throw mf::InputError(last.session, "", "the recording stopped early: " + last.problem);
}

}  // namespace

int main(int argc, char** argv) {
  mf::CommandLine program(
      "mirrorfieldd",
      "The daemon of the rig: records mirror captures from a GigE Vision, USB3 Vision or V4L2 camera when its "
      "button is pressed.",
      MIRRORFIELD_VERSION);
  Arguments arguments;
  program.option("--config", arguments.config, "what the rig is (docs/rig.md)");
  program.option("-o,--output", arguments.output, "record at once, into this session, and end with it");
  program.flag("--record", arguments.record, "record at once, into a new session in the config's folder");
  program.option("--seconds", arguments.seconds, "stop a recording by itself after so long; 0: don't");
  program.option("--replay", arguments.replay, "look for tags and poses in this session again, and record nothing");
  program.flag("--check", arguments.check, "say what is wrong with this machine, and change nothing");
  program.flag("--list", arguments.list, "show the cameras that answer, and record nothing");
  program.on_run([&] {
    if (arguments.list) return list_cameras();
    if (!arguments.replay.empty()) return replay_session(arguments);
    arguments.check ? check(arguments) : run(arguments);
  });
  return program.run(argc, argv);
}
