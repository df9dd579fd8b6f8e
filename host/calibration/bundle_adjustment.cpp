// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/bundle_adjustment.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>

#include "common/check.h"
#include "host/calibration/target_pose.h"

namespace mf {

namespace {

constexpr int camera_count = CameraModel::parameter_count;
constexpr int pose_count = 7;  // quaternion x y z w as Eigen stores it, then translation
constexpr double square_tolerance_px = 1e-4;
using CameraMatrix = Eigen::Matrix<double, camera_count, camera_count>;
using CrossMatrix = Eigen::Matrix<double, camera_count, 6>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using PoseBlock = std::array<double, pose_count>;

// The eight corner errors of a tag, whitened: U (predicted − seen) with UᵀU = information.
struct TagError {
  std::array<Eigen::Vector3d, 4> corners_in_target;
  TagCorners corners_px;
  Eigen::Matrix<double, 8, 8> whitening;

  template <typename T>
  bool operator()(const T* camera, const T* pose, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> rotation(pose);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> translation(pose + 4);
    Eigen::Matrix<T, 8, 1> error;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Matrix<T, 3, 1> x = rotation * corners_in_target[k].cast<T>() + translation;
      if (!(x.z() > T(0))) return false;
      error.template segment<2>(2 * static_cast<Eigen::Index>(k)) =
          project_brown_conrady(camera, x) - corners_px[k].cast<T>();
    }
    Eigen::Map<Eigen::Matrix<T, 8, 1>>(residual, 8).noalias() = whitening.cast<T>() * error;
    return true;
  }
};

struct CameraPrior {
  std::array<double, 5> sigma;
  bool square;

  template <typename T>
  bool operator()(const T* camera, T* residual) const {
    for (std::size_t i = 0; i < 5; ++i) residual[i] = camera[4 + i] / sigma[i];
    residual[5] = square ? (camera[0] - camera[1]) / square_tolerance_px : T(0);
    return true;
  }
};

PoseBlock to_block(const Rigid3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  return {q.x(), q.y(), q.z(), q.w(), pose.translation.x(), pose.translation.y(), pose.translation.z()};
}

Rigid3 to_rigid3(const PoseBlock& b) {
  return {Eigen::Quaterniond(b[3], b[0], b[1], b[2]).normalized(), {b[4], b[5], b[6]}};
}

ceres::Solver::Summary solve(std::array<double, camera_count>& camera, std::vector<PoseBlock>& poses,
                             const std::vector<TargetView>& views, const AdjustmentOptions& options) {
  // Shared among all blocks: the problem must not take any of them.
  ceres::HuberLoss loss(tag_huber_width);
  ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>> manifold;
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  std::vector<int> held;
  for (int i = 0; i < 5; ++i)
    if (!options.free_distortion[static_cast<std::size_t>(i)]) held.push_back(4 + i);
  const ceres::SubsetManifold camera_manifold(camera_count, held);
  ceres::Problem problem(ownership);
  problem.AddParameterBlock(camera.data(), camera_count);
  if (!held.empty()) problem.SetManifold(camera.data(), const_cast<ceres::SubsetManifold*>(&camera_manifold));
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  ordering->AddElementToGroup(camera.data(), 1);
  for (std::size_t i = 0; i < views.size(); ++i) {
    problem.AddParameterBlock(poses[i].data(), pose_count, &manifold);
    ordering->AddElementToGroup(poses[i].data(), 0);
    for (const TagSighting& tag : views[i].tags) {
      if (!tag.inlier) continue;
      const Eigen::Matrix<double, 8, 8> whitening = tag.information.llt().matrixU();
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<TagError, 8, camera_count, pose_count>(
                                   new TagError{tag.corners_in_target, tag.corners_px, whitening}),
                               &loss, camera.data(), poses[i].data());
    }
  }
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CameraPrior, 6, camera_count>(
                               new CameraPrior{options.distortion_prior, options.square_pixels}),
                           nullptr, camera.data());
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.linear_solver_ordering = ordering;
  solver.num_threads = options.threads;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = 1e-9;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary;
}

struct ViewNormal {
  CameraMatrix camera = CameraMatrix::Zero();
  CrossMatrix cross = CrossMatrix::Zero();
  Matrix6 pose = Matrix6::Zero();
};

ViewNormal view_normal(const CameraModel& camera, const TargetView& view, const Rigid3& pose) {
  ViewNormal normal;
  for (const TagSighting& tag : view.tags) {
    if (!tag.inlier) continue;
    Eigen::Matrix<double, 8, camera_count> by_camera;
    Eigen::Matrix<double, 8, 6> by_pose;
    Eigen::Matrix<double, 8, 1> r;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::optional<CornerDerivative> d = corner_derivative(camera, pose, tag.corners_in_target[k]);
      check(d.has_value(), "an adjusted inlier lies in front of the camera");
      const Eigen::Index at = 2 * static_cast<Eigen::Index>(k);
      by_camera.middleRows<2>(at) = d->by_camera;
      by_pose.middleRows<2>(at) = d->by_pose;
      r.segment<2>(at) = d->pixel - tag.corners_px[k];
    }
    const double size = std::sqrt(r.dot(tag.information * r));
    const double weight = size <= tag_huber_width ? 1.0 : tag_huber_width / size;
    const Eigen::Matrix<double, 8, 8> information = weight * tag.information;
    normal.camera += by_camera.transpose() * information * by_camera;
    normal.cross += by_camera.transpose() * information * by_pose;
    normal.pose += by_pose.transpose() * information * by_pose;
  }
  return normal;
}

// A pose that its tags leave open (nothing to invert) gets an infinite covariance.
std::optional<Matrix6> inverse_of(const Matrix6& information) {
  const Eigen::LDLT<Matrix6> ldlt(information);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0)) return std::nullopt;
  return Matrix6(ldlt.solve(Matrix6::Identity()));
}

Matrix6 pose_covariance(const ViewNormal& normal, const CameraMatrix& camera_covariance) {
  const std::optional<Matrix6> alone = inverse_of(normal.pose);
  if (!alone) return Matrix6::Constant(std::numeric_limits<double>::infinity());
  const Eigen::Matrix<double, 6, camera_count> follow = *alone * normal.cross.transpose();
  return *alone + follow * camera_covariance * follow.transpose();
}

// Inverse of the reduced (Schur) system over the free parameters; zero for held ones.
CameraMatrix camera_covariance(const std::vector<ViewNormal>& normals, const AdjustmentOptions& options) {
  CameraMatrix reduced = CameraMatrix::Zero();
  for (const ViewNormal& normal : normals) {
    const std::optional<Matrix6> alone = inverse_of(normal.pose);
    if (alone) reduced += normal.camera - normal.cross * *alone * normal.cross.transpose();
  }
  std::vector<int> free{0, 1, 2, 3};
  for (int i = 0; i < 5; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!options.free_distortion[k]) continue;
    reduced(4 + i, 4 + i) += 1 / (options.distortion_prior[k] * options.distortion_prior[k]);
    free.push_back(4 + i);
  }
  if (options.square_pixels) {
    constexpr double weight = 1 / (square_tolerance_px * square_tolerance_px);
    reduced.topLeftCorner<2, 2>() += weight * (Eigen::Matrix2d() << 1, -1, -1, 1).finished();
  }
  // Focal lengths are hundreds, distortion is hundredths: scale before inverting.
  const Eigen::MatrixXd chosen = reduced(free, free);
  const Eigen::VectorXd scale = chosen.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * chosen * scale.asDiagonal();
  const auto n = static_cast<Eigen::Index>(free.size());
  const Eigen::MatrixXd inverse = scaled.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  CameraMatrix covariance = CameraMatrix::Zero();
  covariance(free, free) = scale.asDiagonal() * inverse * scale.asDiagonal();
  return covariance;
}

}  // namespace

Adjustment adjust_bundle(const CameraModel& start, const std::vector<TargetView>& views,
                         const std::vector<Rigid3>& cam_from_target, const AdjustmentOptions& options) {
  check(views.size() == cam_from_target.size(), "one pose a view");
  std::vector<PoseBlock> poses;
  poses.reserve(views.size());
  for (const Rigid3& pose : cam_from_target) poses.push_back(to_block(pose));
  Adjustment out;
  out.camera = start;
  const ceres::Solver::Summary summary = solve(out.camera.parameters, poses, views, options);
  out.converged = summary.termination_type == ceres::CONVERGENCE;
  std::vector<ViewNormal> normals;
  normals.reserve(views.size());
  for (std::size_t i = 0; i < views.size(); ++i)
    normals.push_back(view_normal(out.camera, views[i], to_rigid3(poses[i])));
  out.camera_covariance = camera_covariance(normals, options);
  for (std::size_t i = 0; i < views.size(); ++i)
    out.poses.push_back({to_rigid3(poses[i]), pose_covariance(normals[i], out.camera_covariance)});
  return out;
}

AdjustedPose pose_with_covariance(const Adjustment& adjustment, const TargetView& view, const Rigid3& pose) {
  return {pose, pose_covariance(view_normal(adjustment.camera, view, pose), adjustment.camera_covariance)};
}

}  // namespace mf
