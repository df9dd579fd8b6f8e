// SPDX-License-Identifier: Apache-2.0
#include "device/sightseer.h"

#include "common/error.h"

namespace mf {

Sightseer::Sightseer(const Options& options, const MirrorTarget& target, const std::optional<WorldTarget>& world,
                     int width, int height)
    : options_(options), target_(target), world_(world), camera_(options.camera) {
  if (camera_ && (camera_->width != width || camera_->height != height))
    throw InputError("detection", "calibration", "is of another picture size: calibrate with these settings");
  if (!camera_) quick_camera_.emplace(target, width, height);
  if (world_) world_pose_.emplace(*world_);
}

std::optional<Rigid3> Sightseer::add(const DetectedFrame& frame) {
  if (!camera_) {
    quick_camera_->add(frame.tags);
    camera_ = quick_camera_->camera();
  }
  if (!camera_) return std::nullopt;
  if (world_pose_) world_pose_->add(frame.tags, *camera_);
  const std::optional<OnlinePose> pose = online_mirror_pose(frame.tags, target_, *camera_);
  if (!pose) return std::nullopt;
  cover(pose->cam_from_target, frame);
  return pose->cam_from_target;
}

void Sightseer::cover(const Rigid3& cam_from_mirror, const DetectedFrame& frame) {
  if (!coverage_) {
    if (!world_pose_ || !world_pose_->pose()) return;
    CoverageOptions coverage = options_.coverage;
    coverage.plane = options_.plane ? *options_.plane : plane_between(*world_);
    coverage_.emplace(coverage, MirrorReach(*camera_, world_pose_->pose()->cam_from_target, target_));
  }
  coverage_->add(cam_from_mirror, frame.luminance, frame.reduction);
  coverage_status_ = coverage_->status();
  coverage_status_->advice =
      guidance_.advise(*coverage_, cam_from_mirror, 1e-9 * static_cast<double>(frame.arrival.monotonic_ns));
}

void Sightseer::forget_coverage() {
  coverage_.reset();
  coverage_status_.reset();
  guidance_ = Guidance();
}

}  // namespace mf
