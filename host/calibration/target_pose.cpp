// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/target_pose.h"

#include <ceres/jet.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "common/dense.h"

namespace mf {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector8 = Eigen::Matrix<double, 8, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  return (Eigen::Matrix3d() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

double huber(double squared) {
  return squared <= tag_huber_width * tag_huber_width
             ? squared
             : 2 * tag_huber_width * std::sqrt(squared) - tag_huber_width * tag_huber_width;
}

// Nothing when a corner lies behind the camera.
std::optional<Vector8> residuals(const CameraModel& camera, const Rigid3& pose, const TagSighting& tag) {
  Vector8 r;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d x = pose * tag.corners_in_target[k];
    if (!(x.z() > 0)) return std::nullopt;
    r.segment<2>(2 * static_cast<Eigen::Index>(k)) = camera.project(x) - tag.corners_px[k];
  }
  return r;
}

struct Minimum {
  Rigid3 pose;
  double cost = std::numeric_limits<double>::infinity();
};

struct Normal {
  Matrix6 matrix = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
};

std::optional<Normal> normal_equations(const CameraModel& camera, const Rigid3& pose, const TargetView& view) {
  Normal normal;
  for (const TagSighting& tag : view.tags) {
    if (!tag.inlier) continue;
    Vector8 r;
    Eigen::Matrix<double, 8, 6> j;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::optional<CornerDerivative> corner = corner_derivative(camera, pose, tag.corners_in_target[k]);
      if (!corner) return std::nullopt;
      const Eigen::Index at = 2 * static_cast<Eigen::Index>(k);
      r.segment<2>(at) = corner->pixel - tag.corners_px[k];
      j.middleRows<2>(at) = corner->by_pose;
    }
    const double size = std::sqrt(r.dot(tag.information * r));
    const double weight = size <= tag_huber_width ? 1.0 : tag_huber_width / size;
    const Eigen::Matrix<double, 6, 8> jt = weight * j.transpose().lazyProduct(tag.information);
    normal.matrix += jt.lazyProduct(j);
    normal.right -= jt * r;
  }
  return normal;
}

// Levenberg–Marquardt; nothing when it does not settle.
std::optional<Minimum> minimize(const CameraModel& camera, const TargetView& view, const Rigid3& start) {
  Minimum best{start, pose_cost(camera, start, view)};
  if (!std::isfinite(best.cost)) return std::nullopt;
  double damping = 1e-3;
  constexpr int most_steps = 60;
  for (int i = 0; i < most_steps; ++i) {
    const std::optional<Normal> normal = normal_equations(camera, best.pose, view);
    if (!normal) return std::nullopt;
    Matrix6 damped = normal->matrix;
    damped.diagonal() *= 1 + damping;
    const std::optional<Eigen::MatrixXd> step = solve_symmetric(damped, normal->right);
    if (!step) return std::nullopt;
    const Rigid3 trial = moved(best.pose, *step);
    const double cost = pose_cost(camera, trial, view);
    if (cost <= best.cost) {
      const bool settled = best.cost - cost < 1e-9 * best.cost + 1e-12;
      best = {trial, cost};
      damping = std::max(damping * 0.1, 1e-9);
      if (settled) return best;
    } else {
      damping *= 10;
      if (damping > 1e8) return best;  // no step helps any more
    }
  }
  return best;
}

Eigen::Vector3d centre_of(const TargetView& view) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (const TagSighting& tag : view.tags) {
    if (!tag.inlier) continue;
    for (const Eigen::Vector3d& corner : tag.corners_in_target) sum += corner;
    count += 4;
  }
  return count > 0 ? Eigen::Vector3d(sum / count) : sum;
}

}  // namespace

std::optional<CornerDerivative> corner_derivative(const CameraModel& camera, const Rigid3& cam_from_target,
                                                  const Eigen::Vector3d& x_in_target) {
  constexpr int n = CameraModel::parameter_count;
  using Jet = ceres::Jet<double, n + 3>;
  const Eigen::Vector3d turned = cam_from_target.rotation * x_in_target;
  const Eigen::Vector3d x = turned + cam_from_target.translation;
  if (!(x.z() > 0)) return std::nullopt;
  std::array<Jet, n> parameters;
  for (int i = 0; i < n; ++i)
    parameters[static_cast<std::size_t>(i)] = Jet(camera.parameters[static_cast<std::size_t>(i)], i);
  const Eigen::Matrix<Jet, 3, 1> jets(Jet(x.x(), n), Jet(x.y(), n + 1), Jet(x.z(), n + 2));
  const Eigen::Matrix<Jet, 2, 1> pixel = project_brown_conrady(parameters.data(), jets);
  CornerDerivative out;
  Eigen::Matrix<double, 2, 3> by_point;
  for (int i = 0; i < 2; ++i) {
    out.pixel[i] = pixel[i].a;
    out.by_camera.row(i) = pixel[i].v.head<n>().transpose();
    by_point.row(i) = pixel[i].v.tail<3>().transpose();
  }
  out.by_pose << by_point * -skew(turned), by_point;
  return out;
}

double pose_cost(const CameraModel& camera, const Rigid3& pose, const TargetView& view) {
  double sum = 0;
  for (const TagSighting& tag : view.tags) {
    if (!tag.inlier) continue;
    const std::optional<Vector8> r = residuals(camera, pose, tag);
    if (!r || !r->allFinite()) return std::numeric_limits<double>::infinity();
    sum += huber(r->dot(tag.information * *r));
  }
  return 0.5 * sum;
}

std::optional<PoseEstimate> estimate_pose(const CameraModel& camera, const TargetView& view, const Rigid3& start) {
  const std::optional<Minimum> first = minimize(camera, view, start);
  const Rigid3& from = first ? first->pose : start;
  const std::optional<Minimum> second = minimize(camera, view, mirrored_tilt(from, centre_of(view)));
  if (!first && !second) return std::nullopt;
  const bool second_wins = second && (!first || second->cost < first->cost);
  const Minimum& best = second_wins ? *second : *first;
  PoseEstimate out{best.pose, best.cost, std::numeric_limits<double>::infinity()};
  constexpr double same_minimum_rad = 1e-3;
  if (first && second && rotation_angle_between(first->pose, second->pose) > same_minimum_rad)
    out.mirrored_cost = second_wins ? first->cost : second->cost;
  return out;
}

}  // namespace mf
