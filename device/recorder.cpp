// SPDX-License-Identifier: Apache-2.0
#include "device/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "common/check.h"

namespace mf {

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

void Recorder::submit(CameraFrame* frame) {
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back({frame, {}});
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
    if (!queue_.empty() && queue_.back().frame == nullptr && queue_.back().gap.reason == reason) {
      queue_.back().gap.missing += missing;
    } else {
      queue_.push_back({nullptr, {0, missing, monotonic_ns, reason}});
      ++status_.gaps;
    }
    status_.lost += missing;
  }
  changed_.notify_all();
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
    fail(e.what());
  }
}

void Recorder::fail(const std::string& why) {
  const std::lock_guard lock(mutex_);
  if (!status_.failure) status_.failure = why;
  queue_.clear();
}

void Recorder::write_frames() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return !queue_.empty() || finishing_ || status_.failure; });
    if (status_.failure || queue_.empty()) break;
    const Queued next = queue_.front();
    queue_.pop_front();
    lock.unlock();
    try {
      write(next);
    } catch (const std::exception& e) {
      fail(e.what());
    }
    lock.lock();
    if (next.frame != nullptr) free_.push_back(next.frame);
  }
  all_written_ = true;
  lock.unlock();
  changed_.notify_all();
}

void Recorder::write(const Queued& next) {
  if (next.frame == nullptr) {
    FrameGap gap = next.gap;
    gap.next_id = next_id_;
    return writer_.append(gap);
  }
  const RecorderStatus now = status();
  const bool hurried = now.queued > options_.queue_frames / 2;
  Frame frame;
  frame.info.name = fmt::format("{:06}", next_id_);
  frame.info.role = FrameRole::mirror;
  frame.info.exposure_s = camera_.exposure_s;
  frame.info.time_s = 1e-9 * static_cast<double>(next.frame->arrival.monotonic_ns - start_ns_);
  frame.pixels = std::move(next.frame->codes);  // lent: it comes back below, so that nothing is allocated
  const auto put_back = [&] { next.frame->codes = std::move(std::get<ImageU16>(frame.pixels)); };
  try {
    EncodedFrame encoded = writer_.encode(frame, hurried ? TiffCompression::none : TiffCompression::deflate);
    encoded.arrival = next.frame->arrival;
    next_id_ = writer_.append(encoded) + 1;
  } catch (...) {
    put_back();
    throw;
  }
  put_back();
  const std::lock_guard lock(mutex_);
  ++status_.written;
  if (hurried) ++status_.uncompressed;
}

void Recorder::sync_regularly() {
  std::unique_lock lock(mutex_);
  while (!all_written_) {
    changed_.wait_for(lock, options_.sync_each, [&] { return all_written_; });
    if (status_.failure) break;
    lock.unlock();
    try {
      const std::int64_t durable = writer_.commit();
      lock.lock();
      status_.durable = durable;
    } catch (const std::exception& e) {
      fail(e.what());
      lock.lock();
      break;
    }
  }
}

}  // namespace mf
