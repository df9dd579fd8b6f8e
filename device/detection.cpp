// SPDX-License-Identifier: Apache-2.0
#include "device/detection.h"

#include <chrono>
#include <utility>

#include "common/error.h"
#include "device/clock.h"

namespace mf {

std::optional<std::string> DetectionOptions::validate() const {
  if (!(duty > 0 && duty <= 1)) return "duty must lie above 0, up to 1";
  if (picture_reduction < 2 || picture_reduction % 2 != 0) return "picture_reduction must be even, 2 or more";
  if (follow.full_each < 1) return "follow.full_each must be 1 or more";
  if (!(follow.margin >= 0)) return "follow.margin must be 0 or more";
  if (!(follow.enough_tags >= 0 && follow.enough_tags <= 1)) return "follow.enough_tags must lie from 0 to 1";
  return std::nullopt;
}

namespace {

const DetectionOptions& require_valid_detection(const DetectionOptions& options) {
  if (const std::optional<std::string> problem = options.validate()) throw InputError("detection", "", *problem);
  return options;
}

}  // namespace

FrameDetector::FrameDetector(const DetectionOptions& options, const ResponseCurve& response, const PixelFormat& format)
    : options_(require_valid_detection(options)),
      levels_(response, format),
      detector_(options.detector),
      follower_(options.follow) {}

std::vector<TagDetection> FrameDetector::tags_in(const ImageU16& codes, const PixelBox& box) {
  std::vector<TagDetection> tags = detector_.detect(levels_.levels(codes, box));
  for (TagDetection& tag : tags)
    for (Eigen::Vector2d& corner : tag.corners_px) corner += Eigen::Vector2d(box.x, box.y);
  return tags;
}

DetectedFrame FrameDetector::detect(const CameraFrame& frame) {
  const std::int64_t start_ns = clock_ns(CLOCK_THREAD_CPUTIME_ID);
  DetectedFrame out;
  out.arrival = frame.arrival;
  const PixelBox whole{0, 0, frame.codes.width, frame.codes.height};
  out.searched = follower_.next(whole.width, whole.height);
  out.tags = tags_in(frame.codes, out.searched);
  if (!follower_.accept(out.searched, whole, out.tags)) {
    out.searched = whole;
    out.tags = tags_in(frame.codes, whole);
    (void)follower_.accept(whole, whole, out.tags);  // a full search always is
  }
  out.reduction = options_.picture_reduction;
  out.luminance = levels_.luminance(frame.codes, out.reduction);
  out.milliseconds = 1e-6 * static_cast<double>(clock_ns(CLOCK_THREAD_CPUTIME_ID) - start_ns);
  return out;
}

Detection::Detection(const DetectionOptions& options, const ResponseCurve& response, const PixelFormat& format,
                     std::function<void(DetectedFrame)> deliver)
    : detector_(options, response, format),
      duty_(options.duty),
      deliver_(std::move(deliver)),
      thread_([this] { run(); }) {}

Detection::~Detection() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  closed_.notify_all();
  slot_ = Slot::closed;
  slot_.notify_all();
  thread_.join();
}

bool Detection::offer(const CameraFrame& frame) {
  ++offered_;
  if (slot_.load(std::memory_order_acquire) != Slot::free) {
    ++skipped_;
    return false;
  }
  frame_ = frame;
  slot_.store(Slot::filled, std::memory_order_release);
  slot_.notify_one();
  return true;
}

DetectionCounts Detection::counts() const {
  return {offered_, skipped_, detected_};
}

void Detection::pause_for(double seconds) {
  std::unique_lock lock(mutex_);
  closed_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return closing_; });
}

// The slot stays taken during the pause, so that the frame which is copied next is a fresh one.
void Detection::run() {
  while (true) {
    slot_.wait(Slot::free);
    if (slot_ == Slot::closed) return;
    const std::int64_t start_ns = clock_ns(CLOCK_THREAD_CPUTIME_ID);
    deliver_(detector_.detect(frame_));
    ++detected_;
    const double used_s = 1e-9 * static_cast<double>(clock_ns(CLOCK_THREAD_CPUTIME_ID) - start_ns);
    pause_for(used_s / duty_ - used_s);
    Slot expected = Slot::filled;  // or closed meanwhile
    slot_.compare_exchange_strong(expected, Slot::free);
  }
}

}  // namespace mf
