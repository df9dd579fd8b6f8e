// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace mf {

// The hemisphere of directions over a plane, cut into patches of nearly the same size in bands of the same height, and
// each patch into 2 × 2 directions. Azimuth runs from x towards y, elevation from the plane upwards.
class DirectionGrid {
 public:
  // `patch_rad`: edge of a patch, 0.02 to 0.8; rounded so that whole bands fill the hemisphere.
  explicit DirectionGrid(double patch_rad);

  [[nodiscard]] int patches() const { return static_cast<int>(patch_centres_.size()); }
  [[nodiscard]] int directions() const { return static_cast<int>(centres_.size()); }
  [[nodiscard]] int patch_of(int direction) const { return patch_of_[static_cast<std::size_t>(direction)]; }

  // Unit vectors.
  [[nodiscard]] const Eigen::Vector3d& centre(int direction) const {
    return centres_[static_cast<std::size_t>(direction)];
  }
  [[nodiscard]] const Eigen::Vector3d& patch_centre(int patch) const {
    return patch_centres_[static_cast<std::size_t>(patch)];
  }
  // ∫ sin(elevation) dω over the direction, sr: all of them together π.
  [[nodiscard]] double projected_solid_angle(int direction) const {
    return projected_[static_cast<std::size_t>(direction)];
  }

  // The direction that a unit vector with z ≥ 0 lies in.
  [[nodiscard]] int find(const Eigen::Vector3d& unit) const;

 private:
  struct Band {
    int first_patch = 0;
    int count = 0;
  };
  double band_rad_;
  std::vector<Band> bands_;
  std::vector<Eigen::Vector3d> patch_centres_, centres_;
  std::vector<double> projected_;
  std::vector<int> patch_of_;
};

}  // namespace mf
