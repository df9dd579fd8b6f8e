// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "device/direction_grid.h"

namespace mf {

// How bright it is out there, learned from rays. Near lights are seen in different directions from different cells, so
// what was seen is kept on a sphere about the plane's centre, whose radius is the one, of a few, on which the rays
// agree best with each other (least variance of radiance within a direction of the sphere). Positions are in metres
// from the plane's centre.
class RadianceMap {
 public:
  explicit RadianceMap(const DirectionGrid&);

  // Radiance (any scale, ≥ 0) along a ray that starts at `from` in direction `unit`, upwards.
  void add(const Eigen::Vector3d& from, const Eigen::Vector3d& unit, double radiance);

  // Chooses the radius anew, from what was added since.
  void settle();

  // Where on the sphere the ray ends; −1 when it starts outside. Holds until the radius changes.
  [[nodiscard]] int place(const Eigen::Vector3d& from, const Eigen::Vector3d& unit) const {
    return place(from, unit, radius_m());
  }
  // At a place. Where nothing was seen: the mean of what was, as the plane feels it; before anything was seen, 1.
  [[nodiscard]] double radiance(int place) const;
  [[nodiscard]] double mean() const { return mean_; }
  [[nodiscard]] double radius_m() const { return radii_m[best_]; }

  static constexpr std::array<double, 6> radii_m{0.7, 1, 1.5, 2.5, 5, 1e4};

 private:
  struct Sums {
    double count = 0, sum = 0, squares = 0;
  };
  [[nodiscard]] int place(const Eigen::Vector3d& from, const Eigen::Vector3d& unit, double radius_m) const;
  [[nodiscard]] double disagreement(const std::vector<Sums>&) const;

  DirectionGrid grid_;
  std::array<std::vector<Sums>, radii_m.size()> spheres_;
  std::size_t best_ = 3;
  double mean_ = 1;
};

}  // namespace mf
