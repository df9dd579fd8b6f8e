// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/virtual_view.h"
#include "host/light_field/resample.h"

namespace mf {

namespace {

constexpr double cell_m = 0.01;
constexpr int grid_cells = 400;       // 4 × 4 m about the middle of the footprints
constexpr double needed_share = 0.1;  // of the views that pass the best-covered point
constexpr double lowest_slope = 0.1;  // z of a unit ray: flatter ones reach the plane far outside
// How far the plane may be from the mirrors, in distances from the camera to them: beyond, it is a slip of the unit.
constexpr double farthest_plane = 10;

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
    if (ray.z() < lowest_slope || height_m <= centre.z()) return std::nullopt;
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

std::vector<Footprint> footprints_on_plane(const Calibration& calibration, const MirrorTarget& target,
                                           double height_m) {
  std::vector<Footprint> footprints;
  for (const MirrorPose& pose : calibration.frames) {
    const auto footprint = pose.used ? footprint_on_plane(calibration, pose, target, height_m) : std::nullopt;
    if (footprint) footprints.push_back(*footprint);
  }
  return footprints;
}

// Some view looks through the rectangle, as far as boxes around both can tell.
bool is_looked_through(const std::vector<Footprint>& footprints, const std::array<double, 4>& r) {
  return std::any_of(footprints.begin(), footprints.end(), [&](const Footprint& f) {
    const auto [x0, x1] = std::minmax({f[0].x(), f[1].x(), f[2].x(), f[3].x()});
    const auto [y0, y1] = std::minmax({f[0].y(), f[1].y(), f[2].y(), f[3].y()});
    return x0 < r[2] && x1 > r[0] && y0 < r[3] && y1 > r[1];
  });
}

// Where the mirrors of the used frames were.
struct Sweep {
  double lowest_m = 0, highest_m = 0;  // above the world's ground
  double from_camera_m = 0;            // median
};
std::optional<Sweep> sweep_of(const Calibration& calibration) {
  std::vector<double> heights, distances;
  const Rigid3 world_from_cam = calibration.cam_from_world->inverse();
  for (const MirrorPose& pose : calibration.frames) {
    if (!pose.used) continue;
    heights.push_back((world_from_cam * pose.cam_from_mirror.translation).z());
    distances.push_back(pose.cam_from_mirror.translation.norm());
  }
  if (heights.empty()) return std::nullopt;
  const auto [lowest, highest] = std::minmax_element(heights.begin(), heights.end());
  return Sweep{*lowest, *highest, median(distances)};
}

// What most of the footprints cover; nothing when they pass no common place.
std::optional<PlaneRectangle> covered_by(const std::vector<Footprint>& footprints, double height_m) {
  if (footprints.empty()) return std::nullopt;
  std::vector<double> xs, ys;
  for (const Footprint& f : footprints) {
    const Eigen::Vector2d centre = 0.25 * (f[0] + f[1] + f[2] + f[3]);
    xs.push_back(centre.x());
    ys.push_back(centre.y());
  }
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
  if ((high.array() <= low.array()).any()) return std::nullopt;
  PlaneRectangle rectangle;
  rectangle.world_from_plane.translation.z() = height_m;
  rectangle.min_m = origin + cell_m * low.cast<double>();
  rectangle.max_m = origin + cell_m * high.cast<double>();
  return rectangle;
}

}  // namespace

std::optional<PlaneRectangle> covered_rectangle(const Calibration& calibration, const MirrorTarget& target,
                                                double height_m) {
  if (!calibration.cam_from_world) return std::nullopt;
  return covered_by(footprints_on_plane(calibration, target, height_m), height_m);
}

PlaneRectangle chosen_rectangle(const Calibration& calibration, const MirrorTarget& target, double height_m,
                                const std::optional<std::array<double, 4>>& wanted, const std::string& file) {
  if (!calibration.cam_from_world)
    throw InputError(file, "cam_from_world", "is missing: record world tags with the session and calibrate again");
  const auto sweep = sweep_of(calibration);
  if (!sweep) throw InputError(file, "frames", "has no used frame: calibrate again, or record more");
  const std::string waved =
      fmt::format("the mirror was waved {:.2f} to {:.2f} m above the ground", sweep->lowest_m, sweep->highest_m);
  const double reach_m = farthest_plane * sweep->from_camera_m;
  if (!(height_m <= sweep->highest_m + reach_m && height_m >= sweep->lowest_m - reach_m))  // nor is NaN one
    throw InputError(
        file, "--height",
        fmt::format("{:g} m is no place for the plane: {}; give a height near that, in metres", height_m, waved));
  const std::vector<Footprint> footprints = footprints_on_plane(calibration, target, height_m);
  if (wanted && is_looked_through(footprints, *wanted)) {
    const auto& r = *wanted;
    return {{Eigen::Quaterniond::Identity(), {0, 0, height_m}}, {r[0], r[1]}, {r[2], r[3]}};
  }
  const auto covered = covered_by(footprints, height_m);
  if (!covered)
    throw InputError(
        file, "--height",
        fmt::format("no mirror view looks through a plane at {:g} m: {}; give a height near that", height_m, waved));
  if (wanted)
    throw InputError(file, "--rectangle",
                     fmt::format("no mirror view looks through it: at this --height they cover {:.2f} {:.2f} {:.2f} "
                                 "{:.2f}; give a part of that, world metres",
                                 covered->min_m.x(), covered->min_m.y(), covered->max_m.x(), covered->max_m.y()));
  const double searched_m = grid_cells * cell_m;
  if (covered->size_m().maxCoeff() > searched_m - 0.5 * cell_m)
    throw InputError(file, "--height",
                     fmt::format("the views spread over more than {:g} × {:g} m at {:g} m: {}; give a height near "
                                 "that, or --rectangle",
                                 searched_m, searched_m, height_m, waved));
  return *covered;
}

}  // namespace mf
