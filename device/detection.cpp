// SPDX-License-Identifier: Apache-2.0
#include "device/detection.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/error.h"
#include "device/clock.h"
#include "device/edge_alignment.h"

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

namespace {

// The tag and what the alignment looks at beside it.
std::optional<PixelBox> box_around(const TagDetection& tag, const ImageU16& codes) {
  constexpr double beside_px = 6;
  Eigen::Vector2d low = tag.corners_px[0], high = tag.corners_px[0];
  for (const Eigen::Vector2d& corner : tag.corners_px) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
  const int x0 = std::max(0, static_cast<int>(low.x() - beside_px)),
            y0 = std::max(0, static_cast<int>(low.y() - beside_px));
  const int x1 = std::min(codes.width, static_cast<int>(high.x() + beside_px) + 1);
  const int y1 = std::min(codes.height, static_cast<int>(high.y() + beside_px) + 1);
  return x1 > x0 && y1 > y0 ? std::optional(PixelBox{x0, y0, x1 - x0, y1 - y0}) : std::nullopt;
}

double shortest_edge_px(const TagDetection& tag) {
  double shortest = 1e9;
  for (std::size_t k = 0; k < 4; ++k)
    shortest = std::min(shortest, (tag.corners_px[k] - tag.corners_px[(k + 1) % 4]).norm());
  return shortest;
}

}  // namespace

// False: the edges cannot be seen, so that the corners would be AprilTag's, half a pixel off.
bool FrameDetector::align(const ImageU16& codes, TagDetection& tag) const {
  const std::optional<PixelBox> box = box_around(tag, codes);
  if (!box) return false;
  constexpr double cells = 8, share = 0.6;  // the dark border of a tag is one of so many cells wide
  const double reach_px = std::clamp(share * shortest_edge_px(tag) / cells, 1.0, 3.0);
  const Eigen::Vector2d origin(box->x, box->y);
  QuadCorners corners = tag.corners_px;
  for (Eigen::Vector2d& corner : corners) corner -= origin;
  const std::optional<QuadCorners> aligned = align_edges(levels_.linear(codes, *box), corners, reach_px);
  if (!aligned) return false;
  for (std::size_t k = 0; k < 4; ++k) tag.corners_px[k] = (*aligned)[k] + origin;
  return true;
}

std::vector<TagDetection> FrameDetector::tags_in(const ImageU16& codes, const PixelBox& box) {
  std::vector<TagDetection> tags = detector_.detect(levels_.levels(codes, box));
  for (TagDetection& tag : tags)
    for (Eigen::Vector2d& corner : tag.corners_px) corner += Eigen::Vector2d(box.x, box.y);
  std::erase_if(tags, [&](TagDetection& tag) { return !align(codes, tag); });
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
