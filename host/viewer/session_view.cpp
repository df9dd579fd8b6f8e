// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/session_view.h"

#include <tbb/parallel_for.h>

#include "common/check.h"
#include "common/virtual_view.h"

namespace mf {

std::optional<Eigen::Vector3d> CaughtRays::ray_through(const Eigen::Vector3d& p) const {
  const Eigen::Vector3d line = (p - centre).normalized();
  int positive = 0, negative = 0;  // sides of the pyramid from the centre over the opening
  for (std::size_t i = 0; i < opening.size(); ++i) {
    const Eigen::Vector3d side = (opening[i] - centre).cross(opening[(i + 1) % opening.size()] - centre);
    ++(side.dot(line) > 0 ? positive : negative);
  }
  if (positive > 0 && negative > 0) return std::nullopt;
  const Eigen::Vector3d middle = 0.25 * (opening[0] + opening[1] + opening[2] + opening[3]);
  return (middle - centre).dot(line) > 0 ? line : Eigen::Vector3d(-line);
}

std::vector<CaughtRays> caught_rays(const Calibration& calibration, const MirrorTarget& target) {
  check(calibration.cam_from_world.has_value(), "caught rays need a world frame");
  const Rigid3 world_from_cam = calibration.cam_from_world->inverse();
  const Eigen::Vector2d half = 0.5 * target.opening_m;
  std::vector<CaughtRays> all;
  for (const MirrorPose& pose : calibration.frames) {
    const auto view = pose.used ? mirror_view(pose.cam_from_mirror, target, calibration.camera) : std::nullopt;
    if (!view || view->opening_in_img.empty()) continue;
    const Rigid3 world_from_mirror = world_from_cam * pose.cam_from_mirror;
    const auto corner = [&](double x, double y) -> Eigen::Vector3d {
      return world_from_mirror * Eigen::Vector3d(x * half.x(), y * half.y(), 0);
    };
    all.push_back(
        {world_from_cam * view->centre_in_cam(), {corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)}});
  }
  return all;
}

SessionView::SessionView(std::vector<CaughtRays> rays, PlaneRectangle plane)
    : rays_(std::move(rays)), plane_(std::move(plane)) {}

ImageF SessionView::counts(int width_px, int height_px) const {
  ImageF counts(width_px, height_px, 1);
  const Eigen::Vector2d size = plane_.size_m();
  tbb::parallel_for(0, height_px, [&](int y) {
    for (int x = 0; x < width_px; ++x)
      counts.at(x, y) = static_cast<float>(seen_at({plane_.min_m.x() + (x + 0.5) / width_px * size.x(),
                                                    plane_.max_m.y() - (y + 0.5) / height_px * size.y()})
                                               .size());
  });
  return counts;
}

std::vector<SessionView::Seen> SessionView::seen_at(const Eigen::Vector2d& p_in_plane) const {
  const Eigen::Vector3d p = plane_.world_from_plane * Eigen::Vector3d(p_in_plane.x(), p_in_plane.y(), 0);
  const Eigen::Quaterniond plane_from_world = plane_.world_from_plane.rotation.conjugate();
  std::vector<Seen> seen;
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const auto ray = rays_[i].ray_through(p);
    if (!ray) continue;
    const Eigen::Vector3d direction = plane_from_world * *ray;
    if (direction.z() > 0) seen.push_back({i, direction});
  }
  return seen;
}

}  // namespace mf
