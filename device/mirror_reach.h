// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/mirror_target.h"
#include "common/rigid3.h"

namespace mf {

struct MirrorReachOptions {
  double clearance_m = 0.02;     // ≥ 0; between the plane and the lowest point of the mirror's frame
  double farthest_m = 0.35;      // > 0; from the point of the plane whose light is shown to the mirror
  double least_facing = 0.35;    // cosine between the mirror's normal and the camera: flatter tags are not read
  double least_tags = 0.4;       // 0 to 1; share of the tags that must be in the picture for a pose to be sure
  double picture_margin = 0.03;  // 0 to 0.4; of the picture's edges that what is wanted stays off: a hand trembles
  double frame_m = 0.004;        // paper beyond a tag's own white border
};

// Where the mirror may be held: above the plane z = 0 of the world, in the picture, its tags readable.
class MirrorReach {
 public:
  MirrorReach(const CameraModel&, const Rigid3& cam_from_world, const MirrorTarget&, const MirrorReachOptions& = {});

  // world_from_mirror of a mirror that shows the camera what arrives at `p` (on the plane) from `direction` (unit
  // length, upwards): where the ray meets it, it faces halfway between the direction and the camera; it is as near to p
  // as clears the plane, and its x axis as near as may be to `right`. Nothing when no such place is in reach.
  [[nodiscard]] std::optional<Rigid3> showing(const Eigen::Vector3d& p, const Eigen::Vector3d& direction,
                                              const Eigen::Vector3d& right_in_world) const;
  [[nodiscard]] bool allows(const Rigid3& world_from_mirror) const {
    return above_plane_m(world_from_mirror) > 0.5 * options_.clearance_m &&
           sees(world_from_mirror, options_.picture_margin);
  }
  // Its middle and enough of its tags are in the picture, and it is not too flat. `margin`: a share of the picture's
  // edges that they stay off.
  [[nodiscard]] bool sees(const Rigid3& world_from_mirror, double margin = 0) const;
  // How far the lowest corner of the mirror's frame is above the plane, metres.
  [[nodiscard]] double above_plane_m(const Rigid3& world_from_mirror) const;

  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  [[nodiscard]] const Rigid3& cam_from_world() const { return cam_from_world_; }
  [[nodiscard]] const Eigen::Vector3d& camera_in_world() const { return camera_in_world_; }
  [[nodiscard]] const Eigen::Vector2d& opening_m() const { return opening_m_; }
  // The picture's right in the world: a mirror held upright has its x axis there.
  [[nodiscard]] Eigen::Vector3d picture_right() const {
    return cam_from_world_.rotation.conjugate() * Eigen::Vector3d::UnitX();
  }

 private:
  [[nodiscard]] bool in_picture(const Eigen::Vector3d& x_in_world, double margin) const;
  [[nodiscard]] double height_for(const Eigen::Matrix3d& world_from_mirror) const;

  CameraModel camera_;
  Rigid3 cam_from_world_;
  Eigen::Vector3d camera_in_world_;
  Eigen::Vector2d opening_m_;
  std::vector<Eigen::Vector2d> tag_centres_m_;
  Eigen::Vector2d half_size_m_;  // of the mirror with its frame
  MirrorReachOptions options_;
};

// The mirror as a window into the light field, without a picture: the camera's place behind it, in the world.
[[nodiscard]] Eigen::Vector3d virtual_centre(const Eigen::Vector3d& camera_in_world, const Rigid3& world_from_mirror);

}  // namespace mf
