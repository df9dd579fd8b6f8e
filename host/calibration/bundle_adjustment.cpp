// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/bundle_adjustment.h"

#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "common/check.h"
#include "common/dense.h"
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

PoseBlock to_block(const Rigid3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  return {q.x(), q.y(), q.z(), q.w(), pose.translation.x(), pose.translation.y(), pose.translation.z()};
}

Rigid3 to_rigid3(const double* b) {
  return {Eigen::Quaterniond(b[3], b[0], b[1], b[2]).normalized(), {b[4], b[5], b[6]}};
}

// A pose moves by (ω, τ) as CornerDerivative says. Costs give their derivatives by those six straight away, in the
// first six of a pose block's seven columns: this manifold only has to pass them on.
class PoseManifold final : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return pose_count; }
  [[nodiscard]] int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* sum) const override {
    const PoseBlock block = to_block(moved(to_rigid3(x), Eigen::Map<const Eigen::Matrix<double, 6, 1>>(delta)));
    std::copy(block.begin(), block.end(), sum);
    return true;
  }
  bool Minus(const double* y, const double* x, double* difference) const override {
    const Rigid3 to = to_rigid3(y), from = to_rigid3(x);
    const Eigen::AngleAxisd turn(to.rotation * from.rotation.inverse());
    Eigen::Map<Eigen::Matrix<double, 6, 1>>(difference) << turn.angle() * turn.axis(),
        to.translation - from.translation;
    return true;
  }
  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, pose_count, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool MinusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, pose_count, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

// A tag's corner errors, predicted − seen, and how they move with camera and pose.
struct TagLinearization {
  Eigen::Matrix<double, 8, 1> error;
  Eigen::Matrix<double, 8, camera_count> by_camera;
  Eigen::Matrix<double, 8, 6> by_pose;
};

// Nothing when a corner lies behind the camera.
std::optional<TagLinearization> linearize(const CameraModel& camera, const Rigid3& pose, const TagSighting& tag) {
  TagLinearization out;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::optional<CornerDerivative> d = corner_derivative(camera, pose, tag.corners_in_target[k]);
    if (!d) return std::nullopt;
    const Eigen::Index at = 2 * static_cast<Eigen::Index>(k);
    out.error.segment<2>(at) = d->pixel - tag.corners_px[k];
    out.by_camera.middleRows<2>(at) = d->by_camera;
    out.by_pose.middleRows<2>(at) = d->by_pose;
  }
  return out;
}

// The eight corner errors of a tag, whitened: U (predicted − seen) with UᵀU = information.
class TagCost final : public ceres::SizedCostFunction<8, camera_count, pose_count> {
 public:
  explicit TagCost(const TagSighting& tag) : tag_(tag), whitening_(tag.information.llt().matrixU()) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    CameraModel camera;
    std::copy_n(parameters[0], camera_count, camera.parameters.begin());
    const std::optional<TagLinearization> tag = linearize(camera, to_rigid3(parameters[1]), tag_);
    if (!tag) return false;
    Eigen::Map<Eigen::Matrix<double, 8, 1>>(residuals, 8) = whitening_.lazyProduct(tag->error);
    if (jacobians == nullptr) return true;
    using ByCamera = Eigen::Matrix<double, 8, camera_count, Eigen::RowMajor>;
    using ByPose = Eigen::Matrix<double, 8, pose_count, Eigen::RowMajor>;
    if (jacobians[0] != nullptr) ByCamera::Map(jacobians[0]) = whitening_.lazyProduct(tag->by_camera);
    if (jacobians[1] != nullptr) {
      Eigen::Map<ByPose> by_pose(jacobians[1]);
      by_pose.leftCols<6>() = whitening_.lazyProduct(tag->by_pose);
      by_pose.col(6).setZero();
    }
    return true;
  }

 private:
  TagSighting tag_;
  Eigen::Matrix<double, 8, 8> whitening_;
};

// Keeps distortion near none, in units of its prior, and the pixels square when asked.
class CameraPrior final : public ceres::SizedCostFunction<6, camera_count> {
 public:
  CameraPrior(const std::array<double, 5>& sigma, bool square) : sigma_(sigma), square_(square) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double* camera = parameters[0];
    for (std::size_t i = 0; i < 5; ++i) residuals[i] = camera[4 + i] / sigma_[i];
    residuals[5] = square_ ? (camera[0] - camera[1]) / square_tolerance_px : 0;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, 6, camera_count, Eigen::RowMajor>> j(jacobians[0]);
    j.setZero();
    for (int i = 0; i < 5; ++i) j(i, 4 + i) = 1 / sigma_[static_cast<std::size_t>(i)];
    if (square_) j.bottomLeftCorner<1, 2>() << 1 / square_tolerance_px, -1 / square_tolerance_px;
    return true;
  }

 private:
  std::array<double, 5> sigma_;
  bool square_;
};

ceres::Solver::Summary solve(std::array<double, camera_count>& camera, std::vector<PoseBlock>& poses,
                             const std::vector<TargetView>& views, const AdjustmentOptions& options) {
  // Shared among all blocks: the problem must not take any of them.
  ceres::HuberLoss loss(tag_huber_width);
  PoseManifold manifold;
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
      problem.AddResidualBlock(new TagCost(tag), &loss, camera.data(), poses[i].data());
    }
  }
  problem.AddResidualBlock(new CameraPrior(options.distortion_prior, options.square_pixels), nullptr, camera.data());
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
    const std::optional<TagLinearization> t = linearize(camera, pose, tag);
    check(t.has_value(), "an adjusted inlier lies in front of the camera");
    const double size = std::sqrt(t->error.dot(tag.information * t->error));
    const double weight = size <= tag_huber_width ? 1.0 : tag_huber_width / size;
    const Eigen::Matrix<double, 8, 8> information = weight * tag.information;
    const Eigen::Matrix<double, camera_count, 8> camera_information = t->by_camera.transpose().lazyProduct(information);
    const Eigen::Matrix<double, 6, 8> pose_information = t->by_pose.transpose().lazyProduct(information);
    normal.camera += camera_information.lazyProduct(t->by_camera);
    normal.cross += camera_information.lazyProduct(t->by_pose);
    normal.pose += pose_information.lazyProduct(t->by_pose);
  }
  return normal;
}

// A pose that its tags leave open (nothing to invert) gets an infinite covariance.
Matrix6 pose_covariance(const ViewNormal& normal, const CameraMatrix& camera_covariance) {
  const std::optional<Eigen::MatrixXd> alone = inverse_of_positive(normal.pose);
  if (!alone) return Matrix6::Constant(std::numeric_limits<double>::infinity());
  const Eigen::Matrix<double, 6, camera_count> follow = alone->lazyProduct(normal.cross.transpose());
  const Eigen::Matrix<double, 6, camera_count> spread = follow.lazyProduct(camera_covariance);
  return *alone + spread.lazyProduct(follow.transpose());
}

// Inverse of the reduced (Schur) system over the free parameters; zero for held ones.
CameraMatrix camera_covariance(const std::vector<ViewNormal>& normals, const AdjustmentOptions& options) {
  CameraMatrix reduced = CameraMatrix::Zero();
  for (const ViewNormal& normal : normals) {
    const std::optional<Eigen::MatrixXd> alone = inverse_of_positive(normal.pose);
    if (!alone) continue;
    const CrossMatrix follow = normal.cross.lazyProduct(*alone);
    reduced += normal.camera - follow.lazyProduct(normal.cross.transpose());
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
  CameraMatrix covariance = CameraMatrix::Zero();
  if (const std::optional<Eigen::MatrixXd> inverse = inverse_of_positive(scaled))
    covariance(free, free) = scale.asDiagonal() * *inverse * scale.asDiagonal();
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
    normals.push_back(view_normal(out.camera, views[i], to_rigid3(poses[i].data())));
  out.camera_covariance = camera_covariance(normals, options);
  for (std::size_t i = 0; i < views.size(); ++i)
    out.poses.push_back({to_rigid3(poses[i].data()), pose_covariance(normals[i], out.camera_covariance)});
  return out;
}

AdjustedPose pose_with_covariance(const Adjustment& adjustment, const TargetView& view, const Rigid3& pose) {
  return {pose, pose_covariance(view_normal(adjustment.camera, view, pose), adjustment.camera_covariance)};
}

}  // namespace mf
