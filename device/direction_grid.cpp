// SPDX-License-Identifier: Apache-2.0
#include "device/direction_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/check.h"

namespace mf {

namespace {

constexpr double pi = std::numbers::pi;

Eigen::Vector3d direction_of(double azimuth, double elevation) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
}

}  // namespace

DirectionGrid::DirectionGrid(double patch_rad) {
  check(patch_rad >= 0.02 && patch_rad <= 0.8, "a patch is a small part of the hemisphere");
  const int band_count = static_cast<int>(std::lround(pi / 2 / patch_rad));
  band_rad_ = pi / 2 / band_count;
  for (int b = 0; b < band_count; ++b) {
    const double low = b * band_rad_;
    const int count = std::max(3, static_cast<int>(std::lround(2 * pi * std::cos(low + band_rad_ / 2) / band_rad_)));
    bands_.push_back({patches(), count});
    for (int p = 0; p < count; ++p) {
      patch_centres_.push_back(direction_of(2 * pi * (p + 0.5) / count, low + band_rad_ / 2));
      for (int i = 0; i < 4; ++i) {
        const double from = low + (i / 2) * band_rad_ / 2, to = from + band_rad_ / 2;
        centres_.push_back(direction_of(2 * pi * (p + 0.25 + 0.5 * (i % 2)) / count, 0.5 * (from + to)));
        projected_.push_back((std::pow(std::sin(to), 2) - std::pow(std::sin(from), 2)) / 2 * pi / count);
        patch_of_.push_back(patches() - 1);
      }
    }
  }
}

int DirectionGrid::find(const Eigen::Vector3d& unit) const {
  const double elevation = std::asin(std::clamp(unit.z(), 0.0, 1.0));
  const double in_band = std::min(elevation / band_rad_, static_cast<double>(bands_.size()) - 1e-9);
  const Band& band = bands_[static_cast<std::size_t>(in_band)];
  double turn = std::atan2(unit.y(), unit.x()) / (2 * pi);
  turn -= std::floor(turn);
  const double in_row = std::min(turn * band.count, band.count - 1e-9);
  const int patch = band.first_patch + static_cast<int>(in_row);
  const int upper = in_band - std::floor(in_band) >= 0.5 ? 2 : 0;
  const int right = in_row - std::floor(in_row) >= 0.5 ? 1 : 0;
  return 4 * patch + upper + right;
}

}  // namespace mf
