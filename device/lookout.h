// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "common/mirror_target.h"
#include "device/detection.h"
#include "device/rig_status.h"
#include "device/sightseer.h"

namespace mf {

struct LookoutOptions {
  DetectionOptions detection;  // follow.ids and the family come from the target
  Sightseer::Options seeing;
};
[[nodiscard]] DetectionOptions detection_options(const LookoutOptions&, const MirrorTarget&);

// K and the distortion of a calibration.json. Throws InputError naming file and field.
[[nodiscard]] CameraModel read_camera_model(const std::filesystem::path& calibration);

// What was seen in one frame.
struct Sight {
  FrameArrival arrival;
  std::vector<TagDetection> tags;
  std::optional<Rigid3> cam_from_mirror;
};

// What the rig sees of its own recording, beside it: tags of the latest frame, the mirror's pose from them, and what of
// the light has been captured. Everything happens in the detection's thread; nobody waits for it.
class Lookout {
 public:
  // The picture's size is of the frames that will be offered. Throws InputError for options that are wrong.
  Lookout(const LookoutOptions&, const MirrorTarget&, const std::optional<WorldTarget>&, const ResponseCurve&,
          const PixelFormat&, int width, int height);
  ~Lookout();

  // From the capturing thread; a frame is looked at when there is time for it.
  void offer(const CameraFrame& frame) { detection_->offer(frame); }
  // The coverage begins anew.
  void begin_recording();
  // Since the last call.
  [[nodiscard]] std::vector<Sight> take_sights();
  // Whether the last frame that was looked at showed a tag of the mirror; nothing before the first.
  [[nodiscard]] std::optional<bool> mirror_in_view() const;
  // The latest preview and coverage.
  void describe(RigStatus&) const;

 private:
  void look(DetectedFrame);

  MirrorTarget target_;
  mutable std::mutex mutex_;  // guards what follows
  Sightseer seer_;
  std::vector<Sight> sights_;
  std::optional<bool> mirror_in_view_;
  std::optional<RigPreview> preview_;

  std::unique_ptr<Detection> detection_;  // last: its thread uses all of the above
};

}  // namespace mf
