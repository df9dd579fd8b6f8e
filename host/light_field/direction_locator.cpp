// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/light_field/direction_set.h"

namespace mf {

namespace {

// Lambert's equal-area map of the upper hemisphere onto the unit disc: cells of a square grid over it hold about the
// same number of triangles each.
Eigen::Vector2f equal_area_disc(const Eigen::Vector3f& d) {
  return d.head<2>() / std::sqrt(1 + std::max(d.z(), 0.0F));
}

int cell_of(float coordinate, int grid) {
  return std::clamp(static_cast<int>((coordinate + 1) * 0.5F * static_cast<float>(grid)), 0, grid - 1);
}

// Barycentric coordinates of the ray along d in a triangle; negative outside.
Eigen::Vector3f barycentric(const DirectionSet& set, const std::array<std::uint32_t, 3>& t, const Eigen::Vector3f& d) {
  Eigen::Matrix3f corners;
  for (int i = 0; i < 3; ++i) corners.col(i) = set.directions[t[static_cast<std::size_t>(i)]];
  const Eigen::Vector3f w = corners.inverse() * d;
  return w / w.sum();
}

}  // namespace

DirectionLocator::DirectionLocator(const DirectionSet& set)
    : set_(&set), grid_(std::clamp(static_cast<int>(std::sqrt(static_cast<double>(set.size()))), 4, 512)) {
  triangles_in_cell_.resize(static_cast<std::size_t>(grid_) * static_cast<std::size_t>(grid_));
  for (std::uint32_t t = 0; t < set.triangles.size(); ++t) {
    Eigen::Vector2f low = Eigen::Vector2f::Constant(2), high = -low;
    for (const std::uint32_t v : set.triangles[t]) {
      const Eigen::Vector2f p = equal_area_disc(set.directions[v]);
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    // Edges bulge a little on the disc; and a query just beyond the rim must still meet the rim's triangles.
    const Eigen::Vector2f margin = Eigen::Vector2f::Constant(1.5F / static_cast<float>(grid_)) + 0.15F * (high - low);
    low -= margin;
    high += margin;
    for (int y = cell_of(low.y(), grid_); y <= cell_of(high.y(), grid_); ++y)
      for (int x = cell_of(low.x(), grid_); x <= cell_of(high.x(), grid_); ++x)
        triangles_in_cell_[static_cast<std::size_t>(y * grid_ + x)].push_back(t);
  }
}

DirectionWeights DirectionLocator::locate(const Eigen::Vector3f& direction) const {
  const Eigen::Vector2f p = equal_area_disc(direction);
  const auto& candidates =
      triangles_in_cell_[static_cast<std::size_t>(cell_of(p.y(), grid_) * grid_ + cell_of(p.x(), grid_))];
  Eigen::Vector3f best = Eigen::Vector3f::Constant(-std::numeric_limits<float>::max());
  DirectionWeights found;
  for (const std::uint32_t t : candidates) {
    const Eigen::Vector3f w = barycentric(*set_, set_->triangles[t], direction);
    if (!w.allFinite() || !(w.minCoeff() > best.minCoeff())) continue;
    best = w;
    found.index = set_->triangles[t];
    if (best.minCoeff() >= 0) break;
  }
  best = best.cwiseMax(0.0F);
  best /= best.sum();
  for (std::size_t i = 0; i < 3; ++i) found.weight[i] = best[static_cast<Eigen::Index>(i)];
  return found;
}

}  // namespace mf
