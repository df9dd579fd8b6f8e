// SPDX-License-Identifier: Apache-2.0
#include "device/rig.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <utility>

#include "common/error.h"
#include "common/json_file.h"
#include "common/seconds_since.h"
#include "device/board.h"
#include "device/clock.h"

namespace mf {

namespace {

using RigClock = std::chrono::steady_clock;

// 20261122-101530, and -2, -3 ... where that is taken already.
std::filesystem::path new_session(const std::filesystem::path& folder) {
  const std::filesystem::path first = folder / fmt::format("{:%Y%m%d-%H%M%S}", fmt::gmtime(std::time(nullptr)));
  std::filesystem::path name = first;
  for (int i = 2; std::filesystem::exists(name); ++i) name = fmt::format("{}-{}", first.string(), i);
  return name;
}

}  // namespace

Rig::Rig(OpenCamera open, const RigOptions& options, RigLinks links)
    : keeper_(std::move(open), options.reopen_each),
      options_(options),
      links_(std::move(links)),
      told_(RigClock::now()),
      rated_(told_) {
  const CameraDescription& camera = keeper_.description();
  spare_.codes = ImageU16(camera.width, camera.height, 1);
  status_.camera = fmt::format("{} {} {}", camera.vendor, camera.model, camera.serial);
  status_.queue_frames = options.recorder.queue_frames;
  if (options.metering)
    meter();
  else
    look_out();
}

// Detection needs the response that is in force.
void Rig::look_out() {
  if (!options_.lookout) return;
  const CameraDescription& camera = keeper_.description();
  const double black_level = options_.header.black_level_hint;
  lookout_.reset();  // the old one's thread ends first
  lookout_ = std::make_unique<Lookout>(*options_.lookout, options_.header.target, options_.header.world,
                                       approximate_response_curve(camera.response, camera.format, black_level),
                                       camera.format, camera.width, camera.height);
}

void Rig::meter() {
  const RigState before = std::exchange(status_.state, RigState::metering);
  tell_now();
  (void)keeper_.meter(*options_.metering, {});  // what it found is in the description
  status_.state = before;
  look_out();
  looked_ = RigClock::now();
  told_ = {};
}

// Between recordings: meters anew when what comes is brighter than what was metered. When it is darker the settings
// stay: who shows the lamp in the mirror, and puts the mirror aside then, wants them for the lamp.
void Rig::watch_light() {
  constexpr double look_each_s = 1;
  if (!options_.metering || seconds_since(looked_) < look_each_s) return;
  looked_ = RigClock::now();
  const CameraDescription& camera = keeper_.description();
  MeteringState state;
  state.exposure_s = camera.exposure_s;
  state.curve = approximate_response_curve(camera.response, camera.format, options_.metering->black_level);
  const MeteringStep step = next_setting(level_counts(spare_.codes, camera.format, {}), state, *options_.metering);
  if (step.clipped_share > options_.metering->clipped_share) meter();
}

// A queue that fills sheds the looking before anything that is recorded.
bool Rig::has_time_to_look() const {
  return !recording_ || recording_->status().queued < options_.recorder.queue_frames / 4;
}

void Rig::note_sights() {
  if (!lookout_) return;
  for (Sight& sight : lookout_->take_sights())
    if (recording_) recording_->note_tags(sight.arrival, std::move(sight.tags), sight.cam_from_mirror);
}

void Rig::step() {
  if (links_.next_command)
    if (const auto command = links_.next_command()) obey(*command);
  CameraFrame& into = recording_ ? recording_->next_buffer() : spare_;
  const Received received = keeper_.receive(into, std::chrono::milliseconds(100));
  if (received == Received::frame) {
    ++frames_;
    if (lookout_ && has_time_to_look()) lookout_->offer(into);
  }
  note_sights();
  if (recording_) {
    const bool scene = scene_comes_ && received == Received::frame;
    recording_->take(received, scene ? FrameRole::scene : FrameRole::mirror);
    scene_comes_ = scene_comes_ && !scene;
    watch_recording();
  } else if (received == Received::frame) {
    watch_light();
  }
  tell_regularly();
}

void Rig::obey(RigCommand command) {
  if (command == RigCommand::start && !recording_) start();
  if (command == RigCommand::stop && recording_) stop();
}

void Rig::start() {
  alarm_.clear();
  continuations_ = 0;
  before_ = {};
  status_.lost_frames = status_.gaps = status_.durable_frames = 0;
  began_ = RigClock::now();
  try {
    const std::int64_t free = free_bytes(options_.recordings).value_or(0);
    if (free < options_.least_free_bytes)
      throw InputError(options_.recordings.string(), "",
                       fmt::format("has {} MB left: free some space before recording", free >> 20));
    begin(options_.session ? *std::exchange(options_.session, std::nullopt) : new_session(options_.recordings));
    forget_waiting_frames();
    scene_comes_ = lookout_ && lookout_->mirror_in_view() == false;
    if (lookout_) lookout_->begin_recording();
  } catch (const InputError& e) {
    end(RigState::error, e.what());
  }
}

// A slow disk takes its time over a new session, and then the camera's own buffers are full: what they hold is old, and
// what came after it is missing. The recording has neither.
void Rig::forget_waiting_frames() {
  const std::int64_t ready_ns = clock_ns(CLOCK_MONOTONIC);
  Received received = Received::frame;
  do received = keeper_.receive(spare_, std::chrono::milliseconds(0));
  while (received == Received::incomplete || (received == Received::frame && spare_.arrival.monotonic_ns < ready_ns));
}

void Rig::begin(const std::filesystem::path& session) {
  recording_.emplace(session, options_.header, keeper_.description(), options_.recorder);
  status_.session = session.string();
  const CameraDescription& camera = keeper_.description();
  if (const auto curve = response_curve_of(camera.response, camera.format, options_.header.black_level_hint))
    write_json_file(session / "response.json", to_json(*curve));
}

void Rig::stop() {
  const RecorderStatus last = recording_->finish();
  note(last);
  recording_.reset();
  end(last.failure ? RigState::error : RigState::done, last.failure.value_or(alarm_));
}

void Rig::end(RigState state, const std::string& problem) {
  status_.state = state;
  status_.problem = problem;
  told_ = {};
}

void Rig::note(const RecorderStatus& r) {
  status_.durable_frames = before_.durable + r.durable;
  status_.lost_frames = before_.lost + r.lost;
  status_.gaps = before_.gaps + r.gaps;
  status_.queued = r.queued;
  status_.seconds = seconds_since(began_);
  if (r.written_anew > 0)
    alarm_ = fmt::format("the disk refused {} files: the frames went to others; use another disk soon", r.written_anew);
}

void Rig::watch_recording() {
  const RecorderStatus now = recording_->status();
  note(now);
  if (now.failure) return now.disk_is_full ? stop() : go_on_elsewhere(now);
  if (now.durable > 0 && status_.state != RigState::recording) {
    status_.state = RigState::recording;
    told_ = {};
  }
  std::string problem = alarm_;
  if (keeper_.camera() == nullptr) problem = "the camera is away: check its cable and its power";
  if (problem.empty() && now.lost > 0) problem = fmt::format("{} frames are missing in {} gaps", now.lost, now.gaps);
  if (problem != std::exchange(status_.problem, problem)) told_ = {};
  if (options_.most_seconds > 0 && status_.seconds >= options_.most_seconds) stop();
}

// What was durable stays as it is, and the failing file is not tried again.
void Rig::go_on_elsewhere(const RecorderStatus& failed) {
  constexpr int most_continuations = 5;  // then the disk is no disk any more
  const std::filesystem::path before = recording_->session();
  const RecorderStatus last = recording_->finish();
  recording_.reset();
  before_.durable += last.durable;
  before_.lost += last.lost;
  before_.gaps += last.gaps + 1;  // the change itself
  if (++continuations_ > most_continuations) return end(RigState::error, *failed.failure);
  try {
    const std::string base = before.string().substr(0, before.string().size() - (continuations_ > 1 ? 2 : 0));
    begin(fmt::format("{}-{}", base, continuations_ + 1));
    alarm_ = fmt::format("{}: the recording goes on in {}", *failed.failure, recording_->session().string());
    status_.problem = alarm_;
    told_ = {};
  } catch (const InputError& e) {
    end(RigState::error, e.what());
  }
}

void Rig::tell_regularly() {
  if (RigClock::now() - told_ < options_.tell_each) return;
  told_ = RigClock::now();
  if (const double since = seconds_since(rated_); since >= 1) {
    status_.frame_rate_hz = static_cast<double>(std::exchange(frames_, 0)) / since;
    rated_ = RigClock::now();
    status_.free_bytes = free_bytes(options_.recordings).value_or(0);
    status_.temperature_c = board_temperature_c();
  }
  status_.exposure_s = keeper_.description().exposure_s;
  if (lookout_) lookout_->describe(status_);
  tell_now();
}

void Rig::tell_now() {
  if (links_.tell) links_.tell(status_);
}

}  // namespace mf
