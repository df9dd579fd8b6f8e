// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/scenario_run.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <new>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/error.h"
#include "common/json_file.h"
#include "common/seconds_since.h"
#include "device/c_handle.h"
#include "device/rig_status_json.h"
#include "hw-sim/buttons.h"
#include "hw-sim/child_process.h"
#include "hw-sim/disk_faults.h"
#include "hw-sim/player.h"
#include "hw-sim/status_listener.h"
#include "hw-sim/truth_files.h"

namespace mf::sim {

namespace {

namespace fs = std::filesystem;
using RunClock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds tick{5};
constexpr milliseconds hold_to_stop{1400};

// The memory through which the daemon's disk is made ill.
class DiskControl {
 public:
  explicit DiskControl(const fs::path& file) {
    const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (descriptor < 0 || ::ftruncate(descriptor, sizeof(DiskFaults)) != 0)
      throw InputError(file.string(), "", "cannot be made: check the folder's permissions");
    void* memory = ::mmap(nullptr, sizeof(DiskFaults), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    ::close(descriptor);
    if (memory == MAP_FAILED) throw InputError(file.string(), "", "cannot be mapped");
    faults_ = new (memory) DiskFaults{};
  }
  DiskControl(const DiskControl&) = delete;
  DiskControl& operator=(const DiskControl&) = delete;
  ~DiskControl() { ::munmap(faults_, sizeof(DiskFaults)); }
  DiskFaults& operator*() const { return *faults_; }
  DiskFaults* operator->() const { return faults_; }

 private:
  DiskFaults* faults_ = nullptr;
};

GigeCameraOptions camera_options(const Scenario& s) {
  GigeCameraOptions o;
  o.address = s.address;
  o.format = *wire_format(s.pixel_format);
  o.width = o.height = s.size_px;
  o.frame_rate_hz = s.frame_rate_hz;
  o.exposure_s = s.exposure_s;
  o.packet_loss = s.packet_loss;
  o.clock_ppm = s.clock_ppm;
  o.seed = s.take.seed;
  return o;
}

void write_rig_config(const fs::path& folder, const Scenario& s) {
  std::ofstream out(folder / "rig.toml");
  out << fmt::format(
      "[camera]\naddress = \"{}\"\n\n[mirror]\ntarget = \"target.json\"\nworld = \"world.json\"\nreflectance = {}\n\n"
      "[recording]\nfolder = \".\"\nblack_level_hint = {}\n\n[status]\nsocket = \"status.sock\"\n\n[button]\n\n{}\n",
      s.address, mirror_reflectance, s.sensor.black_level, s.rig_config);
  if (!out.flush()) throw InputError((folder / "rig.toml").string(), "", "cannot be written");
}

// Everything that runs, from the first look at the daemon to its end.
class Run {
 public:
  Run(const Scenario& scenario, const ScenarioFiles& files, const Take& take,
      std::function<void(const std::string&)> say)
      : scenario_(scenario),
        player_(take, scenario.sensor, scenario.take.seed),
        camera_(camera_options(scenario),
                [this](const GigeShot& shot, std::span<std::uint8_t> into) { player_.expose(shot, into); }),
        disk_(files.folder / "disk"),
        testbed_(umockdev_testbed_new()),
        button_(testbed_.get(), {}),
        listener_(files.folder / "status.sock"),
        say_(std::move(say)) {
    button_.plug_in();
    const std::string faults_library = (files.daemon.parent_path() / "libmirrorfield-sim-disk.so").string();
    daemon_.emplace(std::vector<std::string>{files.daemon.string(), "--config", (files.folder / "rig.toml").string()},
                    std::map<std::string, std::string>{{"LD_PRELOAD", umockdev_library + (":" + faults_library)},
                                                       {"MIRRORFIELD_SIM_DISK", (files.folder / "disk").string()}});
  }

  ScenarioResult play();
  [[nodiscard]] std::vector<PlayedFrame> played() const { return player_.played(); }

 private:
  void step();
  template <typename Condition>
  void wait_until(const std::string& what, double at_most_s, const Condition&);
  void press();
  void hold();
  void apply_faults(double now_s);
  void begin_fault(const Fault&);
  void end_fault(const Fault&);

  const Scenario& scenario_;
  Player player_;
  GigeCamera camera_;
  DiskControl disk_;
  std::unique_ptr<UMockdevTestbed, FreeWith<g_object_unref>> testbed_;
  SimulatedButton button_;
  StatusListener listener_;
  std::function<void(const std::string&)> say_;
  std::optional<ChildProcess> daemon_;
  RigState told_ = RigState::idle;
  std::size_t begun_ = 0;  // of the faults, which are in their order
  std::vector<Fault> under_way_;
};

// Between two looks at the daemon.
void Run::step() {
  std::this_thread::sleep_for(tick);
  const RigStatus& now = listener_.latest();
  if (const auto code = daemon_->wait(milliseconds(0)))
    throw InputError("mirrorfieldd", "", fmt::format("ended by itself, with exit code {}: see what it said", *code));
  if (now.state == told_) return;
  told_ = now.state;
  say_(fmt::format("the rig is {}{}{}", rig_state_name(now.state), now.problem.empty() ? "" : ": ", now.problem));
}

template <typename Condition>
void Run::wait_until(const std::string& what, double at_most_s, const Condition& condition) {
  const RunClock::time_point start = RunClock::now();
  while (!condition()) {
    if (seconds_since(start) > at_most_s)
      throw InputError("mirrorfieldd", "", fmt::format("{} s are over, and {}", at_most_s, what));
    step();
  }
}

void Run::press() {
  constexpr int bounces = 3;
  button_.contact(true, bounces);
  std::this_thread::sleep_for(milliseconds(80));
  button_.contact(false, bounces);
}

void Run::hold() {
  button_.contact(true, 2);
  std::this_thread::sleep_for(hold_to_stop);
  button_.contact(false, 2);
}

void Run::begin_fault(const Fault& f) {
  say_(fmt::format("fault {}", fault_name(f.kind)));
  switch (f.kind) {
    case FaultKind::packet_loss:
      return camera_.set_packet_loss(f.amount);
    case FaultKind::camera_death:
      return camera_.die();
    case FaultKind::skipped:
      return camera_.skip_frames(static_cast<int>(f.amount));
    case FaultKind::jitter:
      return camera_.set_jitter(f.amount);
    case FaultKind::slow_disk:
      disk_->delay_us = static_cast<std::int32_t>(1e6 * f.amount);
      return;
    case FaultKind::full_disk:
    case FaultKind::io_error: {
      const std::int32_t error = f.kind == FaultKind::full_disk ? ENOSPC : EIO;
      disk_->failures = f.amount > 0 ? static_cast<std::int32_t>(f.amount) : -1;
      disk_->write_error = error;
      disk_->sync_error = error;
      return;
    }
    case FaultKind::knock:
      return press();
    case FaultKind::replug:
      return button_.unplug();
  }
}

void Run::end_fault(const Fault& f) {
  if (f.kind == FaultKind::packet_loss) camera_.set_packet_loss(scenario_.packet_loss);
  if (f.kind == FaultKind::camera_death) camera_.revive();
  if (f.kind == FaultKind::jitter) camera_.set_jitter(0);
  if (f.kind == FaultKind::slow_disk) disk_->delay_us = 0;
  if (f.kind == FaultKind::full_disk || f.kind == FaultKind::io_error) disk_->write_error = disk_->sync_error = 0;
  if (f.kind == FaultKind::replug) button_.plug_in();
}

void Run::apply_faults(double now_s) {
  std::erase_if(under_way_, [&](const Fault& f) {
    const bool over = now_s >= f.at_s + f.seconds;
    if (over) end_fault(f);
    return over;
  });
  for (; begun_ < scenario_.faults.size() && now_s >= scenario_.faults[begun_].at_s; ++begun_) {
    begin_fault(scenario_.faults[begun_]);
    under_way_.push_back(scenario_.faults[begun_]);
  }
}

ScenarioResult Run::play() {
  constexpr double at_most_s = 20;
  wait_until("it has told nothing on its socket", at_most_s, [&] { return listener_.connected(); });
  wait_until("it does not meter", at_most_s,
             [&] { return told_ != RigState::metering && listener_.latest().frame_rate_hz > 0; });
  player_.put_mirror_aside();
  const RunClock::time_point met = RunClock::now();
  wait_until("no frames come", at_most_s + scenario_.lead_s,
             [&] { return seconds_since(met) >= scenario_.lead_s && listener_.latest().frame_rate_hz > 0; });
  say_("the button is pressed");
  const RunClock::time_point pressed = RunClock::now();
  press();
  wait_until("it does not record", at_most_s, [&] { return told_ == RigState::recording; });
  ScenarioResult result;
  result.first_durable_s = seconds_since(pressed);
  player_.begin();
  const RunClock::time_point begun = RunClock::now();
  // A recording that ended by itself (a full disk) is over; so is one whose last frame was sent.
  while (!player_.ended() && (told_ == RigState::recording || !under_way_.empty())) {
    apply_faults(seconds_since(begun));
    step();
  }
  for (const Fault& f : under_way_) end_fault(f);
  std::this_thread::sleep_for(std::chrono::duration<double>(scenario_.tail_s));
  if (listener_.latest().state == RigState::recording) {
    say_("the button is held");
    hold();
  }
  wait_until("the recording does not end", at_most_s,
             [&] { return told_ == RigState::done || told_ == RigState::error; });
  result.last = listener_.latest();
  result.session = result.last.session;
  result.camera = camera_.counts();
  daemon_->signal(SIGTERM);
  result.daemon_exit_code = daemon_->wait(std::chrono::seconds(20)).value_or(-1);
  return result;
}

void write_played(const fs::path& truth, const std::vector<PlayedFrame>& played) {
  nlohmann::json list = nlohmann::json::array();
  for (const PlayedFrame& f : played)
    list.push_back({{"number", f.number},
                    {"take_frame", f.take_frame},
                    {"monotonic_ns", f.monotonic_ns},
                    {"exposure_s", f.exposure_s}});
  write_json_file(truth / "played.json", list);
}

}  // namespace

ScenarioResult run_scenario(const Scenario& scenario, const ScenarioFiles& files, const Progress& progress,
                            const std::function<void(const std::string&)>& say) {
  std::shared_ptr<const EnvironmentMap> panorama;
  if (!scenario.panorama.empty()) panorama = std::make_shared<EnvironmentMap>(read_environment_map(scenario.panorama));
  std::error_code error;
  if (!fs::create_directory(files.folder, error))
    throw InputError(files.folder.string(), "",
                     error ? error.message() : "exists already: give a new folder or remove it");
  const fs::path folder = fs::absolute(files.folder);
  const DeskRig rig(scenario.size_px, scenario.take.seed, panorama);
  const Take take(rig, scenario.take, scenario.sensor, progress);
  write_target(folder, rig.plate.target());
  write_world(folder, rig.scene.world);
  write_rig_config(folder, scenario);
  ScenarioResult result;
  std::vector<PlayedFrame> played;
  {
    Run run(scenario, {folder, files.daemon}, take, say);
    result = run.play();
    played = run.played();
  }
  const TruthOptions truth{scenario.take.seed, scenario.take.scene_samples, 1};
  write_truth(folder / "truth", rig, take.poses(), std::nullopt, take.scene(), truth, progress);
  write_played(folder / "truth", played);
  return result;
}

}  // namespace mf::sim
