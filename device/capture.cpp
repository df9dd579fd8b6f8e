// SPDX-License-Identifier: Apache-2.0
#include "device/capture.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "common/error.h"
#include "device/clock.h"

namespace mf {

namespace {

using Clock = std::chrono::steady_clock;

nlohmann::json document_of(const CameraDescription& d) {
  return {{"vendor", d.vendor},
          {"model", d.model},
          {"serial", d.serial},
          {"wire_format", d.wire_format},
          {"exposure_s", d.exposure_s},
          {"gain_db", d.gain_db},
          {"frame_rate_hz", d.frame_rate_hz},
          {"genicam_xml", d.genicam_xml}};
}

bool same_frames(const CameraDescription& a, const CameraDescription& b) {
  return a.format == b.format && a.width == b.width && a.height == b.height;
}

class Capture {
 public:
  Capture(const OpenCamera& open, const std::filesystem::path& session, SessionHeader header,
          const CaptureOptions& options)
      : open_(open), options_(options), camera_(open()), description_(camera_->description()) {
    const std::int64_t start_ns = clock_ns(CLOCK_MONOTONIC);
    camera_->start();  // before there is a session: a camera that does not start leaves none
    header.format = description_.format;
    header.width = description_.width;
    header.height = description_.height;
    SessionWriter writer(session, header, {SessionWriter::Durability::batches});
    writer.write_document("device", document_of(description_));
    recorder_.emplace(std::move(writer), description_, start_ns, options.recorder);
    spare_.codes = ImageU16(description_.width, description_.height, 1);
  }

  void step();
  [[nodiscard]] RecorderStatus status() const { return recorder_->status(); }
  [[nodiscard]] CaptureResult finish(double seconds) {
    camera_.reset();
    recorder_->finish();
    return {description_, recorder_->status(), seconds};
  }

 private:
  void reopen();
  void count(const FrameArrival&);

  OpenCamera open_;
  CaptureOptions options_;
  std::unique_ptr<CameraSource> camera_;  // nothing while it is lost
  CameraDescription description_;
  std::optional<Recorder> recorder_;
  CameraFrame spare_;  // received into when the recorder has no room: the camera must not be kept waiting
  std::int64_t last_number_ = 0;
  Clock::time_point next_try_;
};

// Tells the recorder of frames that the camera's numbers say are missing before this one.
void Capture::count(const FrameArrival& arrival) {
  if (last_number_ != 0 && arrival.device_frame != 0) {
    const std::int64_t missing = frames_between(last_number_, arrival.device_frame);
    if (missing > 0) recorder_->note_gap(missing, arrival.monotonic_ns, "the camera's numbers skip");
  }
  last_number_ = arrival.device_frame;
}

void Capture::step() {
  if (camera_ == nullptr) return reopen();
  CameraFrame* buffer = recorder_->acquire();
  CameraFrame& into = buffer != nullptr ? *buffer : spare_;
  const Received received = camera_->receive(into, std::chrono::milliseconds(100));
  if (received == Received::frame || received == Received::incomplete) count(into.arrival);
  if (received == Received::frame && buffer != nullptr) return recorder_->submit(buffer);
  if (received == Received::frame)
    recorder_->note_gap(1, into.arrival.monotonic_ns, "the disk did not keep up: the queue was full");
  if (received == Received::incomplete)
    recorder_->note_gap(1, into.arrival.monotonic_ns, "parts of the frame were lost on the way");
  if (buffer != nullptr) recorder_->give_back(buffer);
  if (received != Received::lost) return;
  camera_.reset();
  last_number_ = 0;
  recorder_->note_gap(0, clock_ns(CLOCK_MONOTONIC), "the camera was lost");
  next_try_ = Clock::now();
}

void Capture::reopen() {
  if (Clock::now() < next_try_) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return;
  }
  next_try_ = Clock::now() + options_.reopen_each;
  try {
    std::unique_ptr<CameraSource> camera = open_();
    // Another camera, or one that forgot its settings, would not fit into this session.
    if (!same_frames(camera->description(), description_)) return;
    camera->start();
    camera_ = std::move(camera);
  } catch (const InputError&) {  // not back yet
  }
}

}  // namespace

std::int64_t frames_between(std::int64_t before, std::int64_t after) {
  if (after > before) return after - before - 1;
  constexpr std::int64_t last_of_16_bits = 65535;
  const bool wrapped = before <= last_of_16_bits && before - after > last_of_16_bits / 2;
  return wrapped ? last_of_16_bits - before + after - 1 : 0;
}

CaptureResult capture(const OpenCamera& open, const std::filesystem::path& session, SessionHeader header,
                      const CaptureOptions& options, const std::atomic<bool>& stop,
                      const std::function<void(const RecorderStatus&)>& each_second) {
  Capture run(open, session, std::move(header), options);
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  double told = 0;
  while (!stop && (options.most_seconds <= 0 || elapsed() < options.most_seconds)) {
    run.step();
    if (run.status().failure) break;
    if (!each_second || elapsed() - told < 1) continue;
    told = elapsed();
    each_second(run.status());
  }
  return run.finish(elapsed());
}

}  // namespace mf
