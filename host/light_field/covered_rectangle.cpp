// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "common/virtual_view.h"
#include "host/light_field/resample.h"

namespace mf {

namespace {

constexpr double cell_m = 0.01;
constexpr int grid_cells = 400;       // 4 × 4 m about the middle of the footprints
constexpr double needed_share = 0.1;  // of the views that pass the best-covered point
constexpr double lowest_slope = 0.1;  // z of a unit ray: flatter ones reach the plane far outside

using Footprint = std::array<Eigen::Vector2d, 4>;

// Where the rays that a view saw through the mirror's opening cross the plane.
std::optional<Footprint> footprint_on_plane(const Calibration& calibration, const MirrorPose& pose,
                                            const MirrorTarget& target, double height_m) {
  const auto view = mirror_view(pose.cam_from_mirror, target, calibration.camera);
  if (!view) return std::nullopt;
  const Rigid3 world_from_cam = calibration.cam_from_world->inverse();
  const Eigen::Vector3d centre = world_from_cam * view->centre_in_cam();
  const Eigen::Vector2d half = 0.5 * target.opening_m;
  Footprint footprint;
  const std::array<Eigen::Vector2d, 4> signs{Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1), Eigen::Vector2d(1, 1),
                                             Eigen::Vector2d(-1, 1)};
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d corner = half.cwiseProduct(signs[i]);
    const Eigen::Vector3d ray =
        (world_from_cam * (pose.cam_from_mirror * Eigen::Vector3d(corner.x(), corner.y(), 0)) - centre).normalized();
    if (ray.z() < lowest_slope) return std::nullopt;
    footprint[i] = (centre + (height_m - centre.z()) / ray.z() * ray).head<2>();
  }
  return footprint;
}

bool inside_convex(const Footprint& polygon, const Eigen::Vector2d& p) {
  int sides = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d e = polygon[(i + 1) % 4] - polygon[i], d = p - polygon[i];
    sides += e.x() * d.y() - e.y() * d.x() > 0 ? 1 : -1;
  }
  return std::abs(sides) == 4;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::optional<PlaneRectangle> covered_rectangle(const Calibration& calibration, const MirrorTarget& target,
                                                double height_m) {
  if (!calibration.cam_from_world) return std::nullopt;
  std::vector<Footprint> footprints;
  std::vector<double> xs, ys;
  for (const MirrorPose& pose : calibration.frames) {
    const auto footprint = pose.used ? footprint_on_plane(calibration, pose, target, height_m) : std::nullopt;
    if (!footprint) continue;
    footprints.push_back(*footprint);
    const Eigen::Vector2d centre = 0.25 * ((*footprint)[0] + (*footprint)[1] + (*footprint)[2] + (*footprint)[3]);
    xs.push_back(centre.x());
    ys.push_back(centre.y());
  }
  if (footprints.empty()) return std::nullopt;
  const Eigen::Vector2d origin = Eigen::Vector2d(median(xs), median(ys)).array() - 0.5 * grid_cells * cell_m;
  std::vector<int> count(static_cast<std::size_t>(grid_cells) * grid_cells, 0);
  for (const Footprint& f : footprints) {
    Eigen::Array2d low = f[0], high = f[0];
    for (const Eigen::Vector2d& corner : f) {
      low = low.min(corner.array());
      high = high.max(corner.array());
    }
    const auto cell = [&](const Eigen::Array2d& p) -> Eigen::Array2i {
      return ((p - origin.array()) / cell_m).max(0).min(grid_cells).cast<int>();
    };
    const Eigen::Array2i first = cell(low), last = (cell(high) + 1).min(grid_cells);
    for (int y = first.y(); y < last.y(); ++y)
      for (int x = first.x(); x < last.x(); ++x)
        if (inside_convex(f, origin + cell_m * Eigen::Vector2d(x + 0.5, y + 0.5)))
          ++count[static_cast<std::size_t>(y * grid_cells + x)];
  }
  const int needed =
      std::max(1, static_cast<int>(std::ceil(needed_share * *std::max_element(count.begin(), count.end()))));
  Eigen::Vector2i low(grid_cells, grid_cells), high(-1, -1);
  for (int y = 0; y < grid_cells; ++y)
    for (int x = 0; x < grid_cells; ++x)
      if (count[static_cast<std::size_t>(y * grid_cells + x)] >= needed) {
        low = low.cwiseMin(Eigen::Vector2i(x, y));
        high = high.cwiseMax(Eigen::Vector2i(x + 1, y + 1));
      }
  PlaneRectangle rectangle;
  rectangle.world_from_plane.translation.z() = height_m;
  rectangle.min_m = origin + cell_m * low.cast<double>();
  rectangle.max_m = origin + cell_m * high.cast<double>();
  return rectangle;
}

}  // namespace mf
