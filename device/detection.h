// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/frame.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "common/tag_detector.h"
#include "device/camera_source.h"
#include "device/frame_levels.h"
#include "device/tag_follower.h"

namespace mf {

struct DetectionOptions {
  TagDetectorOptions detector{"tag36h11", 2};  // quad_decimate 2: a fifth of the time, corners as good
  double duty = 0.25;         // 0 to 1; share of one core that detection may use: it pauses after each frame
  int picture_reduction = 4;  // even; frame pixels per pixel of the luminance picture and the preview
  TagFollowerOptions follow;  // follow.ids: the mirror's tags

  // What is wrong, or nothing.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// What was seen in one frame.
struct DetectedFrame {
  FrameArrival arrival;
  std::vector<TagDetection> tags;  // in pixels of the frame
  PixelBox searched;               // where tags were looked for
  double milliseconds = 0;         // of one core's time, for everything
  ImageF luminance;                // linear, of the whole frame: FrameLevels::luminance()
  int reduction = 1;               // frame pixels per pixel of `luminance`
};

// Tags of one frame: levels, search near the last place or everywhere, corners aligned on linear light, luminance. Not
// thread-safe. Throws InputError for options that are wrong.
class FrameDetector {
 public:
  FrameDetector(const DetectionOptions&, const ResponseCurve&, const PixelFormat&);
  [[nodiscard]] DetectedFrame detect(const CameraFrame&);

 private:
  [[nodiscard]] std::vector<TagDetection> tags_in(const ImageU16& codes, const PixelBox&);
  [[nodiscard]] bool align(const ImageU16& codes, TagDetection&) const;

  DetectionOptions options_;
  FrameLevels levels_;
  TagDetector detector_;
  TagFollower follower_;
};

struct DetectionCounts {
  std::int64_t offered = 0;
  std::int64_t skipped = 0;  // the detector was busy, or paused to keep its duty
  std::int64_t detected = 0;
};

// FrameDetector in a thread of its own, never in the recorder's way: a frame is copied only when the detector is free
// for it, and nobody waits.
class Detection {
 public:
  // `deliver` is called in the detection's thread, once a frame. What it throws ends the program, as in any thread.
  Detection(const DetectionOptions&, const ResponseCurve&, const PixelFormat&,
            std::function<void(DetectedFrame)> deliver);
  Detection(const Detection&) = delete;
  Detection& operator=(const Detection&) = delete;
  ~Detection();  // ends after the frame that is being looked at

  // From the capturing thread: true when the frame was taken (copied). Never blocks.
  bool offer(const CameraFrame&);

  [[nodiscard]] DetectionCounts counts() const;

 private:
  enum class Slot : int { free, filled, closed };
  void run();
  void pause_for(double seconds);

  FrameDetector detector_;
  double duty_;
  std::function<void(DetectedFrame)> deliver_;
  CameraFrame frame_;  // belongs to whoever the slot says: free: offer(), filled: the thread
  std::atomic<Slot> slot_{Slot::free};
  std::atomic<std::int64_t> offered_{0}, skipped_{0}, detected_{0};
  std::mutex mutex_;  // guards closing_
  std::condition_variable closed_;
  bool closing_ = false;
  std::thread thread_;
};

}  // namespace mf
