// SPDX-License-Identifier: Apache-2.0
#include "common/virtual_view.h"

#include "common/check.h"

namespace mf {

namespace {

// The opening's outline in the image. With lens distortion its edges are curves: follow them with a few points each.
Polygon2 project_opening(const Rigid3& cam_from_mirror, const MirrorTarget& target, const CameraModel& camera) {
  const Eigen::Vector2d half = 0.5 * target.opening_m;
  const std::array<Eigen::Vector2d, 4> corners{
      Eigen::Vector2d(-half.x(), -half.y()), Eigen::Vector2d(half.x(), -half.y()), Eigen::Vector2d(half.x(), half.y()),
      Eigen::Vector2d(-half.x(), half.y())};
  const int steps = camera.has_distortion() ? 16 : 1;
  Polygon2 outline;
  for (std::size_t i = 0; i < corners.size(); ++i)
    for (int s = 0; s < steps; ++s) {
      const double f = static_cast<double>(s) / steps;
      const Eigen::Vector2d p = (1 - f) * corners[i] + f * corners[(i + 1) % corners.size()];
      const Eigen::Vector3d in_cam = cam_from_mirror * Eigen::Vector3d(p.x(), p.y(), 0);
      if (in_cam.z() <= 0) return {};
      outline.push_back(camera.project(in_cam));
    }
  return outline;
}

}  // namespace

std::optional<VirtualView> mirror_view(const Rigid3& cam_from_mirror, const MirrorTarget& target,
                                       const CameraModel& camera) {
  const Eigen::Vector3d camera_in_mirror = cam_from_mirror.inverse().translation;
  if (!(camera_in_mirror.z() > 0)) return std::nullopt;
  Eigen::Matrix4d s =
      cam_from_mirror.matrix() * Eigen::Vector4d(1, 1, -1, 1).asDiagonal() * cam_from_mirror.inverse().matrix();
  s.row(0) *= -1;  // image x flipped back: a proper pose
  const std::optional<Rigid3> view_from_cam = Rigid3::from_matrix(s);
  check(view_from_cam.has_value(), "a reflection with x flipped is a rigid transform");
  return VirtualView{*view_from_cam, true, project_opening(cam_from_mirror, target, camera)};
}

}  // namespace mf
