// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <random>
#include <vector>

#include "common/camera_model.h"
#include "common/mirror_target.h"
#include "common/rigid3.h"
#include "common/tag_detector.h"

namespace mf::test {

inline double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class TagCamera {
 public:
  TagCamera(const CameraModel& camera, double sigma_px, unsigned seed)
      : camera_(camera), noise_(0, sigma_px), random_(seed) {}

  // The tag's corners with Gaussian noise; nothing when one leaves the picture.
  template <typename Corners>
  [[nodiscard]] std::optional<TagDetection> see(int id, const Corners& in_target, const Rigid3& cam_from_target) {
    TagDetection tag;
    tag.id = id;
    for (std::size_t k = 0; k < 4; ++k) {
      Eigen::Vector3d x = Eigen::Vector3d::Zero();
      x.head(in_target[k].size()) = in_target[k];
      const Eigen::Vector3d in_cam = cam_from_target * x;
      if (!(in_cam.z() > 0)) return std::nullopt;
      tag.corners_px[k] = camera_.project(in_cam) + Eigen::Vector2d(noise_(random_), noise_(random_));
      if (!(tag.corners_px[k].minCoeff() > 0) || tag.corners_px[k].x() > camera_.width ||
          tag.corners_px[k].y() > camera_.height)
        return std::nullopt;
    }
    return tag;
  }
  [[nodiscard]] std::vector<TagDetection> see(const MirrorTarget& target, const Rigid3& cam_from_mirror) {
    std::vector<TagDetection> tags;
    for (const PlanarTag& tag : target.tags)
      if (const auto seen = see(tag.id, tag.corners_m(), cam_from_mirror)) tags.push_back(*seen);
    return tags;
  }
  [[nodiscard]] std::vector<TagDetection> see(const WorldTarget& world, const Rigid3& cam_from_world) {
    std::vector<TagDetection> tags;
    for (const WorldTag& tag : world.tags)
      if (const auto seen = see(tag.id, tag.corners_in_world(), cam_from_world)) tags.push_back(*seen);
    return tags;
  }
  [[nodiscard]] std::mt19937& random() { return random_; }

 private:
  CameraModel camera_;
  std::normal_distribution<double> noise_;
  std::mt19937 random_;
};

}  // namespace mf::test
