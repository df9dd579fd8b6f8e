// SPDX-License-Identifier: Apache-2.0
#include "device/radiance_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mf {

RadianceMap::RadianceMap(const DirectionGrid& grid) : grid_(grid) {
  for (std::vector<Sums>& sphere : spheres_) sphere.resize(static_cast<std::size_t>(grid.directions()));
}

// The direction, from the centre, of the point where the ray meets the sphere; −1 when it starts outside.
int RadianceMap::place(const Eigen::Vector3d& from, const Eigen::Vector3d& unit, double radius_m) const {
  const double outside = from.squaredNorm() - radius_m * radius_m;
  if (!(outside < 0)) return -1;
  const double b = from.dot(unit);
  return grid_.find((from + (std::sqrt(b * b - outside) - b) * unit) / radius_m);
}

void RadianceMap::add(const Eigen::Vector3d& from, const Eigen::Vector3d& unit, double radiance) {
  for (std::size_t i = 0; i < radii_m.size(); ++i) {
    const int at = place(from, unit, radii_m[i]);
    if (at < 0) continue;
    Sums& sums = spheres_[i][static_cast<std::size_t>(at)];
    sums.count += 1;
    sums.sum += radiance;
    sums.squares += radiance * radiance;
  }
}

// Mean variance within a direction, over the mean square.
double RadianceMap::disagreement(const std::vector<Sums>& sphere) const {
  double within = 0, squares = 0, count = 0;
  for (const Sums& s : sphere) {
    if (s.count < 2) continue;
    within += s.count * std::max(0.0, s.squares - s.sum * s.sum / s.count) / (s.count - 1);
    squares += s.squares;
    count += s.count;
  }
  return count > 0 && squares > 0 ? within / squares : std::numeric_limits<double>::infinity();
}

void RadianceMap::settle() {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < radii_m.size(); ++i) {
    const double d = disagreement(spheres_[i]);
    if (!(d < least)) continue;
    least = d;
    best_ = i;
  }
  double light = 0, seen = 0;
  for (int d = 0; d < grid_.directions(); ++d) {
    const Sums& s = spheres_[best_][static_cast<std::size_t>(d)];
    if (s.count == 0) continue;
    light += s.sum / s.count * grid_.projected_solid_angle(d);
    seen += grid_.projected_solid_angle(d);
  }
  mean_ = light > 0 ? light / seen : 1;
}

double RadianceMap::radiance(int place) const {
  if (place < 0) return mean_;
  const Sums& s = spheres_[best_][static_cast<std::size_t>(place)];
  return s.count > 0 ? s.sum / s.count : mean_;
}

}  // namespace mf
