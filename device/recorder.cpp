// SPDX-License-Identifier: Apache-2.0
#include "device/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "common/check.h"
#include "common/error.h"

namespace mf {

namespace {

double smoothed(double before_s, std::chrono::steady_clock::duration now) {
  constexpr double share = 0.1;
  return (1 - share) * before_s + share * std::chrono::duration<double>(now).count();
}

}  // namespace

Recorder::Recorder(SessionWriter writer, const CameraDescription& camera, std::int64_t start_monotonic_ns,
                   const RecorderOptions& options)
    : writer_(std::move(writer)), camera_(camera), start_ns_(start_monotonic_ns), options_(options) {
  check(options.queue_frames >= 2 && options.sync_each.count() > 0, "a recorder has a queue and syncs");
  buffers_.resize(static_cast<std::size_t>(options.queue_frames));
  for (CameraFrame& buffer : buffers_) {
    buffer.codes = ImageU16(camera.width, camera.height, 1);
    free_.push_back(&buffer);
  }
  writing_ = std::thread([this] { write_frames(); });
  syncing_ = std::thread([this] { sync_regularly(); });
}

Recorder::~Recorder() {
  finish();
}

CameraFrame* Recorder::acquire() {
  const std::lock_guard lock(mutex_);
  if (free_.empty() || status_.failure || finishing_) return nullptr;
  CameraFrame* frame = free_.back();
  free_.pop_back();
  return frame;
}

void Recorder::submit(CameraFrame* frame, FrameRole role) {
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(SubmittedFrame{frame, role});
    status_.most_queued = std::max(status_.most_queued, queued());
  }
  changed_.notify_all();
}

void Recorder::give_back(CameraFrame* frame) {
  const std::lock_guard lock(mutex_);
  free_.push_back(frame);
}

void Recorder::note_gap(std::int64_t missing, std::int64_t monotonic_ns, const std::string& reason) {
  {
    const std::lock_guard lock(mutex_);
    // In a full queue every frame is refused until one is free: that is one gap, not many.
    auto* last = queue_.empty() ? nullptr : std::get_if<FrameGap>(&queue_.back());
    if (last != nullptr && last->reason == reason) {
      last->missing += missing;
    } else {
      queue_.push_back(FrameGap{0, missing, monotonic_ns, reason});
      ++status_.gaps;
    }
    status_.lost += missing;
  }
  changed_.notify_all();
}

void Recorder::note_tags(const FrameArrival& arrival, std::vector<TagDetection> tags,
                         const std::optional<Rigid3>& cam_from_mirror) {
  const std::lock_guard lock(mutex_);
  if (status_.failure || finishing_) return;
  queue_.push_back(SeenTags{arrival.monotonic_ns, {0, std::move(tags), cam_from_mirror}});
  changed_.notify_all();
}

void Recorder::write_document(const std::string& key, const nlohmann::json& document) {
  if (status().failure) return;
  try {
    writer_.write_document(key, document);
  } catch (const std::exception& e) {
    fail(e);
  }
}

RecorderStatus Recorder::status() const {
  const std::lock_guard lock(mutex_);
  RecorderStatus status = status_;
  status.queued = queued();
  return status;
}

void Recorder::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  changed_.notify_all();
  if (writing_.joinable()) writing_.join();
  if (!syncing_.joinable()) return;
  syncing_.join();
  try {
    writer_.finish();
    const std::lock_guard lock(mutex_);
    if (!status_.failure) status_.durable = status_.written;
  } catch (const std::exception& e) {
    fail(e);
  }
}

void Recorder::fail(const std::exception& why) {
  const std::lock_guard lock(mutex_);
  if (status_.failure) return;
  status_.failure = why.what();
  const auto* refused = dynamic_cast<const WriteError*>(&why);
  status_.disk_is_full = refused != nullptr && refused->disk_is_full();
  // What waited will not be written any more.
  for (const Queued& waiting : queue_)
    if (std::holds_alternative<SubmittedFrame>(waiting)) ++status_.lost;
  queue_.clear();
}

void Recorder::write_frames() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return !queue_.empty() || finishing_ || status_.failure; });
    if (status_.failure || queue_.empty()) break;
    const Queued next = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    try {
      std::visit([&](const auto& item) { write(item); }, next);
    } catch (const std::exception& e) {
      fail(e);
    }
    lock.lock();
    if (const auto* written = std::get_if<SubmittedFrame>(&next)) free_.push_back(written->frame);
  }
  all_written_ = true;
  lock.unlock();
  changed_.notify_all();
}

void Recorder::write(const FrameGap& noted) {
  FrameGap gap = noted;
  gap.next_id = next_id_;
  writer_.append(gap);
}

void Recorder::write(const SeenTags& noted) {
  const auto found = id_at_.find(noted.monotonic_ns);
  if (found == id_at_.end()) return;
  FrameTags seen = noted.seen;
  seen.frame = found->second;
  writer_.append(std::move(seen));
}

void Recorder::write(const SubmittedFrame& next) {
  const FrameArrival arrival = next.frame->arrival;
  // A slow disk would only take longer over more bytes.
  const bool hurried = status().queued > options_.queue_frames / 2 && encoding_s_ > writing_s_;
  Frame frame;
  frame.info = {fmt::format("{:06}", next_id_), next.role, camera_.exposure_s, 0,
                1e-9 * static_cast<double>(arrival.monotonic_ns - start_ns_)};
  const auto begun = std::chrono::steady_clock::now();
  frame.pixels = std::move(next.frame->codes);  // lent, so that nothing is allocated
  EncodedFrame encoded = writer_.encode(frame, hurried ? TiffCompression::none : TiffCompression::deflate);
  next.frame->codes = std::move(std::get<ImageU16>(frame.pixels));
  encoded.arrival = arrival;
  const auto encoded_at = std::chrono::steady_clock::now();
  next_id_ = writer_.append(std::move(encoded)) + 1;
  if (!hurried) encoding_s_ = smoothed(encoding_s_, encoded_at - begun);
  writing_s_ = smoothed(writing_s_, std::chrono::steady_clock::now() - encoded_at);
  remember(arrival, next_id_ - 1);
  const std::lock_guard lock(mutex_);
  ++status_.written;
  status_.written_anew = writer_.written_anew();
  if (hurried) ++status_.uncompressed;
  if (status_.written == 1) changed_.notify_all();
}

void Recorder::remember(const FrameArrival& arrival, std::int64_t id) {
  constexpr std::size_t remembered = 256;  // seconds: nobody looks at a frame for longer
  id_at_[arrival.monotonic_ns] = id;
  if (id_at_.size() > remembered) id_at_.erase(id_at_.begin());
}

void Recorder::sync_regularly() {
  std::unique_lock lock(mutex_);
  while (!all_written_) {
    // The first frame at once: the operator waits for the lamp.
    changed_.wait_for(lock, options_.sync_each,
                      [&] { return all_written_ || (status_.durable == 0 && status_.written > 0); });
    if (status_.failure) break;
    lock.unlock();
    try {
      const std::int64_t durable = writer_.commit();
      lock.lock();
      status_.durable = durable;
    } catch (const std::exception& e) {
      fail(e);
      lock.lock();
      break;
    }
  }
}

}  // namespace mf
