// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/camera_model.h"
#include "common/mirror_target.h"
#include "common/robust_homography.h"
#include "common/tag_detector.h"

namespace mf {

struct QuickCameraOptions {
  int fewest_views = 10;            // ≥ 3; different ones, before anything is said
  int most_views = 30;              // of which the solution is made; later frames are passed over
  int fewest_tags = 6;              // that agree, for a frame to count
  double differ_rad = 0.12;         // views are different when the mirror is tilted so much otherwise
  double consensus_px = 6;          // see OnlinePoseOptions; wider, for a lens bends planes
  double most_focal_sigma = 0.004;  // relative; until the focal length is this certain nothing is told
  double most_centre_sigma = 0.01;  // of the picture's width; a less certain centre is put into the picture's middle
};

// The camera's K from the first frames of a mirror that is waved, for a rig that was never calibrated: Zhang's closed
// form, then all poses and one focal length (fx = fy), with the centre free where the views determine it, refined
// together by Gauss–Newton with the poses eliminated. No lens distortion: good enough to say where the mirror is held,
// not to make pictures from.
class QuickCamera {
 public:
  QuickCamera(MirrorTarget, int width_px, int height_px, const QuickCameraOptions& = {});

  // The tags of one frame. Cheap, except for the frames that are taken up (some milliseconds).
  void add(std::span<const TagDetection>);

  [[nodiscard]] const std::optional<CameraModel>& camera() const { return camera_; }
  [[nodiscard]] int views() const { return static_cast<int>(views_.size()); }

 private:
  struct View {
    std::vector<TagInPlane> tags;
    Homography picture_from_plane;
    Eigen::Vector3d normal;  // towards the camera, with a guessed focal length
  };
  [[nodiscard]] std::optional<View> view_of(std::span<const TagDetection>) const;
  [[nodiscard]] bool is_different(const View&) const;
  void solve();

  MirrorTarget target_;
  int width_;
  int height_;
  QuickCameraOptions options_;
  std::vector<View> views_;
  std::optional<CameraModel> camera_;
};

}  // namespace mf
