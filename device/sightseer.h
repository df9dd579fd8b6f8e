// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "common/mirror_target.h"
#include "device/coverage.h"
#include "device/detection.h"
#include "device/guidance.h"
#include "device/online_pose.h"
#include "device/quick_camera.h"
#include "device/rig_status.h"

namespace mf {

// What the tags of one frame after the other tell: the camera, the world's pose, the mirror's poses, and what of the
// light has been captured. One thread.
class Sightseer {
 public:
  // `camera`: of the rig's last calibration; nothing: a quick one, from the first frames. `plane`: nothing: what the
  // world's tags span.
  struct Options {
    std::optional<CameraModel> camera;
    std::optional<LightPlane> plane;
    CoverageOptions coverage;
  };
  // The picture's size is of the frames. Throws InputError when the camera is of another.
  Sightseer(const Options&, const MirrorTarget&, const std::optional<WorldTarget>&, int width, int height);

  // cam_from_mirror, when it can be told.
  std::optional<Rigid3> add(const DetectedFrame&);
  // Camera and world stay known.
  void forget_coverage();
  // Nothing before the world's pose and one of the mirror's are known.
  [[nodiscard]] const std::optional<CoverageStatus>& coverage() const { return coverage_status_; }

 private:
  void cover(const Rigid3& cam_from_mirror, const DetectedFrame&);

  Options options_;
  MirrorTarget target_;
  std::optional<WorldTarget> world_;
  std::optional<QuickCamera> quick_camera_;  // as long as the camera is not known
  std::optional<CameraModel> camera_;
  std::optional<WorldPoseEstimate> world_pose_;
  std::optional<Coverage> coverage_;
  Guidance guidance_;
  std::optional<CoverageStatus> coverage_status_;
};

}  // namespace mf
