// SPDX-License-Identifier: Apache-2.0
#include "tests/device/scripted_camera.h"

#include <random>
#include <thread>

#include "common/error.h"

namespace mf::test {

namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

CameraDescription scripted_description() {
  CameraDescription d;
  d.vendor = "Mirrorfield";
  d.model = "scripted";
  d.format = {PixelLayout::bayer_rg, 12};
  d.wire_format = "BayerRG12";
  d.width = 64;
  d.height = 48;
  d.exposure_s = 0.004;
  return d;
}

ImageU16 scripted_codes(std::int64_t number) {
  const CameraDescription d = scripted_description();
  ImageU16 image(d.width, d.height, 1);
  std::mt19937 random(static_cast<unsigned>(number));
  for (std::uint16_t& code : image.data) code = static_cast<std::uint16_t>(random() & 0xFFF);
  return image;
}

SessionHeader header_with_target() {
  SessionHeader header;
  header.target.family = "tag36h11";
  header.target.opening_m = {0.1, 0.1};
  header.target.tags = {{0, 0.03, {-0.09, 0.0}}, {1, 0.03, {0.09, 0.0}}};
  return header;
}

ScriptedCamera::ScriptedCamera(std::shared_ptr<ScriptRun> run)
    : run_(std::move(run)), description_(scripted_description()) {
  if (run_->died && Clock::now() < run_->back_at) throw InputError("scripted", "address", "does not answer");
}

Received ScriptedCamera::receive(CameraFrame& into, std::chrono::milliseconds at_most) {
  ScriptRun& run = *run_;
  const Script& script = run.script;
  if (script.dies_after > 0 && run.next > script.dies_after && !run.died) {
    run.died = true;
    run.back_at = Clock::now() + script.dead_for;
    return Received::lost;
  }
  while (script.skipped.contains(run.next)) ++run.next;
  if (run.next > script.frames) {
    run.done = true;
    std::this_thread::sleep_for(at_most);
    return Received::nothing;
  }
  run.next_at = std::max(run.next_at + script.period, Clock::now());
  std::this_thread::sleep_until(run.next_at);
  const int number = run.next++;
  const std::int64_t now = std::chrono::nanoseconds(Clock::now().time_since_epoch()).count();
  into.arrival = {number, number * 1000, now, now};
  if (script.incomplete.contains(number)) return Received::incomplete;
  into.codes = scripted_codes(number);
  return Received::frame;
}

}  // namespace mf::test
