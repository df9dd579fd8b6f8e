// SPDX-License-Identifier: Apache-2.0
#include "device/recording.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "device/clock.h"

namespace mf {

namespace {

nlohmann::json document_of(const CameraDescription& d) {
  return {{"vendor", d.vendor},
          {"model", d.model},
          {"serial", d.serial},
          {"wire_format", d.wire_format},
          {"exposure_s", d.exposure_s},
          {"gain_db", d.gain_db},
          {"frame_rate_hz", d.frame_rate_hz},
          {"response", to_json(d.response)},
          {"steady", {{"readings", to_json(d.steady.readings)}, {"remarks", d.steady.remarks}}},
          {"ptp",
           {{"available", d.ptp.available},
            {"enabled", d.ptp.enabled},
            {"status", d.ptp.status},
            {"offset_ns", d.ptp.offset_ns ? nlohmann::json(*d.ptp.offset_ns) : nlohmann::json()},
            {"readings", to_json(d.ptp.readings)},
            {"remarks", d.ptp.remarks}}},
          {"genicam_xml", d.genicam_xml}};
}

}  // namespace

Recording::Recording(const std::filesystem::path& session, SessionHeader header, const CameraDescription& camera,
                     const RecorderOptions& options)
    : session_(session) {
  header.format = camera.format;
  header.width = camera.width;
  header.height = camera.height;
  SessionWriter writer(session, header, {SessionWriter::Durability::batches, true});
  writer.write_document("device", document_of(camera));
  recorder_.emplace(std::move(writer), camera, clock_ns(CLOCK_MONOTONIC), options);
  spare_.codes = ImageU16(camera.width, camera.height, 1);
}

CameraFrame& Recording::next_buffer() {
  if (buffer_ == nullptr) buffer_ = recorder_->acquire();
  return buffer_ != nullptr ? *buffer_ : spare_;
}

// Tells the recorder of what the camera's numbers and its clock say about the time before this frame.
void Recording::count(const FrameArrival& now) {
  if (last_.device_frame != 0 && now.device_frame != 0) {
    const std::int64_t missing = frames_between(last_.device_frame, now.device_frame);
    if (missing > 0) recorder_->note_gap(missing, now.monotonic_ns, "the camera's numbers skip");
    if (now.device_frame == last_.device_frame)
      recorder_->note_gap(0, now.monotonic_ns, "the camera's number repeats: perhaps the frame, too");
  }
  if (now.device_ns != 0) {
    const ClockEvent event = clock_.add(now.device_ns, now.monotonic_ns);
    if (event == ClockEvent::jumped) recorder_->note_gap(0, now.monotonic_ns, "the camera's clock jumped");
    if (event == ClockEvent::restarted) recorder_->note_gap(0, now.monotonic_ns, "the camera's clock began anew");
  }
  last_ = now;
}

void Recording::take(Received received, FrameRole role) {
  CameraFrame& into = buffer_ != nullptr ? *buffer_ : spare_;
  if (received == Received::frame || received == Received::incomplete) count(into.arrival);
  if (received == Received::incomplete)
    recorder_->note_gap(1, into.arrival.monotonic_ns, "parts of the frame were lost on the way");
  if (received == Received::lost) {
    recorder_->note_gap(0, clock_ns(CLOCK_MONOTONIC), "the camera was lost");
    last_ = {};
  }
  if (received != Received::frame) return;
  if (buffer_ == nullptr)
    return recorder_->note_gap(1, into.arrival.monotonic_ns, "the disk did not keep up: the queue was full");
  recorder_->submit(std::exchange(buffer_, nullptr), role);
}

RecorderStatus Recording::finish() {
  if (buffer_ != nullptr) recorder_->give_back(std::exchange(buffer_, nullptr));
  if (const auto clock = clock_.clock())
    recorder_->write_document("clock", {{"device_at_ns", clock->device_at_ns},
                                        {"monotonic_at_ns", clock->host_at_ns},
                                        {"host_per_device", clock->host_per_device},
                                        {"lateness_ns", clock->lateness_ns},
                                        {"events", clock_.events()}});
  recorder_->finish();
  return recorder_->status();
}

std::int64_t frames_between(std::int64_t before, std::int64_t after) {
  if (after > before) return after - before - 1;
  constexpr std::int64_t last_of_16_bits = 65535;
  const bool wrapped = before <= last_of_16_bits && before - after > last_of_16_bits / 2;
  return wrapped ? last_of_16_bits - before + after - 1 : 0;
}

}  // namespace mf
