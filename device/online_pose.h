// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "common/camera_model.h"
#include "common/mirror_target.h"
#include "common/rigid3.h"
#include "common/tag_detector.h"

namespace mf {

struct OnlinePoseOptions {
  int fewest_tags = 2;                // ≥ 1; that agree on one plane
  double consensus_px = 4;            // > 0; a tag with a corner farther from where the others have it does not count
  double huber_px = 0.5;              // > 0; corners that fit worse than this are weighted down
  double most_rms_px = 1.5;           // > 0; a pose that fits worse is none
  double most_rotation_sigma = 0.02;  // radians; of a pose as uncertain as this nothing is told
  double surely = 1.4;                // > 1; the pose with the opposite tilt must fit so many times worse
};

struct OnlinePose {
  Rigid3 cam_from_target;
  double rms_px = 0;  // of the corners of the tags that count
  int tags = 0;       // that count
};

// The mirror's pose (cam_from_mirror) from the tags of one frame: homography by RANSAC, pose in closed form, robust
// Gauss–Newton on the corners from that start and from the one tilted the other way (Schweighofer & Pinz 2006).
//
// Nothing when too few tags agree, the reflecting side faces away, or the pose is uncertain or ambiguous. Ghosts don't
// count: a tag seen in the mirror is mirror-written, so its corners run the other way round or, if it was misread as
// another one, lie where no plane with the others has them. Tags of other targets are passed over.
[[nodiscard]] std::optional<OnlinePose> online_mirror_pose(std::span<const TagDetection>, const MirrorTarget&,
                                                           const CameraModel&, const OnlinePoseOptions& = {});

// The world's pose (cam_from_world), which the mirror and the hand hide in part: the camera stands still, so each tag's
// corners are taken as the median over the frames that saw it, and the pose fits all tags seen so far.
class WorldPoseEstimate {
 public:
  WorldPoseEstimate(WorldTarget, const OnlinePoseOptions& = {});

  // The tags of one frame. The pose is estimated again while a tag that is seen has fewer than 25 samples.
  void add(std::span<const TagDetection>, const CameraModel&);

  [[nodiscard]] const std::optional<OnlinePose>& pose() const { return pose_; }
  // The camera was knocked: in ten frames in a row that saw its tags they lay elsewhere, by more than `consensus_px`.
  // The estimate has then begun anew; what was captured before has another camera pose.
  [[nodiscard]] int times_moved() const { return times_moved_; }

 private:
  using Corners = std::array<Eigen::Vector2d, 4>;
  void estimate(const CameraModel&);
  [[nodiscard]] std::optional<bool> elsewhere(std::span<const TagDetection>) const;

  WorldTarget target_;
  OnlinePoseOptions options_;
  std::map<int, std::vector<Corners>> samples_;  // by id
  std::optional<OnlinePose> pose_;
  int frames_elsewhere_ = 0;
  int times_moved_ = 0;
};

}  // namespace mf
