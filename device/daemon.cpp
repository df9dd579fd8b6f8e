// SPDX-License-Identifier: Apache-2.0
#include "device/daemon.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/json_file.h"
#include "device/aravis_source.h"
#include "device/instance_lock.h"
#include "device/lamp.h"
#include "device/rig.h"
#include "device/rig_status_json.h"
#include "device/service_notice.h"
#include "device/status_socket.h"
#include "device/usb_reset.h"
#include "device/v4l2_source.h"

namespace mf {

namespace {

using DaemonClock = std::chrono::steady_clock;

SessionHeader header_of(const DeviceConfig& config) {
  SessionHeader header;
  header.black_level_hint = config.black_level_hint;
  header.mirror_reflectance = config.mirror_reflectance;
  header.target = mirror_target_from_json(read_json_file(config.target), config.target.string());
  if (config.world) header.world = world_target_from_json(read_json_file(*config.world), config.world->string());
  return header;
}

RigOptions rig_options(const DeviceConfig& config, const DaemonOptions& o) {
  RigOptions r;
  r.recordings = config.recordings;
  r.session = o.session;
  r.header = header_of(config);
  r.recorder = config.recorder;
  r.metering = config.metering;
  r.lookout = config.lookout;
  r.most_seconds = o.most_seconds;
  return r;
}

LampState lamp_state(const RigStatus& status) {
  // A recording that loses frames, or its camera, is in error until it doesn't: the operator must look.
  if (status.state == RigState::error || !status.problem.empty()) return LampState::error;
  if (status.state == RigState::recording) return LampState::recording;
  return status.state == RigState::done ? LampState::done : LampState::idle;
}

// The button that the config names, if any, and every lamp there is.
class Operator {
 public:
  explicit Operator(const OperatorConfig& config) {
    std::vector<LightSwitch> lights;
    if (config.button) button_ = open_start_button(*config.button);
    if (config.hid_button) {
      std::unique_ptr<HidButton> hid = open_hid_button(*config.hid_button);
      lights.emplace_back([button = hid.get()](bool lit) { button->light(lit); });
      button_ = std::move(hid);
    }
    if (!config.led.empty()) lights.push_back(led_switch(config.led));
    if (!lights.empty()) lamp_.emplace(std::move(lights));
  }

  [[nodiscard]] std::optional<RigCommand> asks() {
    const auto event = button_ ? button_->poll(std::chrono::milliseconds(0)) : std::nullopt;
    if (!event) return std::nullopt;
    return *event == ButtonEvent::start ? RigCommand::start : RigCommand::stop;
  }
  void sees(const RigStatus& status, bool recording) {
    if (button_) button_->set_recording(recording);
    if (lamp_) lamp_->set(lamp_state(status));
  }

 private:
  std::unique_ptr<Button> button_;
  std::optional<Lamp> lamp_;  // after the button, whose light it may switch
};

// Reminds systemd that the daemon lives, as often as it wants.
class Watchdog {
 public:
  void tick() {
    if (!each_ || DaemonClock::now() - last_ < *each_) return;
    last_ = DaemonClock::now();
    notice_alive();
  }

 private:
  std::optional<std::chrono::microseconds> each_ = notice_alive_each();
  DaemonClock::time_point last_{};
};

// Opens the camera again and again while it is away. A USB camera that was there and does not answer for a while hangs:
// its port is reset.
class CameraOpener {
 public:
  explicit CameraOpener(CameraSettings settings) : settings_(std::move(settings)) {}

  std::unique_ptr<CameraSource> operator()() {
    try {
      std::unique_ptr<CameraSource> camera = open_camera(settings_);
      serial_ = camera->description().serial;
      failing_since_.reset();
      return camera;
    } catch (const InputError&) {
      reset_if_it_hangs();
      throw;
    }
  }

 private:
  void reset_if_it_hangs() {
    constexpr std::chrono::seconds patience{3};
    const bool network = settings_.address.find_first_not_of("0123456789.") == std::string::npos;
    if (serial_.empty() || (network && !settings_.address.empty())) return;
    const DaemonClock::time_point now = DaemonClock::now();
    if (!failing_since_) failing_since_ = now;
    if (now - *failing_since_ < patience) return;
    failing_since_ = now;
    // Whatever came of it, the next opening shows: an absent device is not on the bus, and nothing is reset.
    (void)reset_usb_device({0, 0, serial_});
  }

  CameraSettings settings_;
  std::string serial_;  // of the camera that was there
  std::optional<DaemonClock::time_point> failing_since_;
};

void require_a_start(const DeviceConfig& config, const DaemonOptions& options) {
  const OperatorConfig& o = config.operating;
  if (options.record_now || o.button || o.hid_button || config.status.remote_start) return;
  throw InputError("mirrorfieldd", "config",
                   "nothing could start a recording: add [button] or [hid_button], or remote_start to [status], or "
                   "record at once with --record");
}

}  // namespace

std::unique_ptr<CameraSource> open_camera(const CameraSettings& settings) {
  if (settings.address.starts_with("/dev/")) return open_v4l2_source(settings);
  if (!settings.address.empty() || !find_aravis_cameras().empty()) return open_aravis_source(settings);
  return open_v4l2_source(settings);
}

RigStatus run_daemon(const DeviceConfig& config, const DaemonOptions& options, const std::atomic<bool>& stop,
                     const std::function<void(const RigStatus&)>& show) {
  require_a_start(config, options);
  const InstanceLock lock(config.recordings);
  std::optional<StatusSocket> socket;
  if (!options.record_now || std::filesystem::exists(config.status.socket.parent_path()))
    socket.emplace(StatusSocketOptions{
        .path = config.status.socket, .group = config.status.group, .accept_start = config.status.remote_start});
  Operator person(config.operating);
  Rig* running = nullptr;
  RigLinks links;
  links.next_command = [&]() -> std::optional<RigCommand> {
    if (socket && socket->take_start_request()) return RigCommand::start;
    return person.asks();
  };
  links.tell = [&](const RigStatus& status) {
    person.sees(status, running != nullptr && running->is_recording());
    if (socket) socket->publish(status);
    notice_status(fmt::format("{}: {} frames{}{}", rig_state_name(status.state), status.durable_frames,
                              status.problem.empty() ? "" : ", ", status.problem));
    if (show) show(status);
  };
  Rig rig([opener = CameraOpener(config.camera)]() mutable { return opener(); }, rig_options(config, options), links);
  running = &rig;
  notice_ready();
  Watchdog watchdog;
  if (options.record_now) rig.obey(RigCommand::start);
  while (!stop && (!options.record_now || rig.is_recording())) {
    rig.step();
    watchdog.tick();
  }
  notice_stopping();
  rig.obey(RigCommand::stop);
  links.tell(rig.status());
  return rig.status();
}

}  // namespace mf
