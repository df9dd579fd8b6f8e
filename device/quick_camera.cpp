// SPDX-License-Identifier: Apache-2.0
#include "device/quick_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/dense.h"
#include "common/plane_pose.h"
#include "common/zhang.h"
#include "device/pixel_derivative.h"

namespace mf {

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

struct Problem {
  std::vector<std::span<const TagInPlane>> views;
  int unknowns = 1;  // of the camera: f, or f, cx, cy
};

struct State {
  CameraModel camera;
  std::vector<Rigid3> poses;
};

// One view's share of the normal equations: camera, pose, and both.
struct Block {
  Eigen::MatrixXd camera, both;
  Matrix6 pose = Matrix6::Zero();
  Eigen::VectorXd camera_right;
  Vector6 pose_right = Vector6::Zero();
  double squares = 0;
};

std::optional<Block> block_of(const CameraModel& camera, const Rigid3& pose, std::span<const TagInPlane> tags, int n) {
  Block b;
  b.camera = Eigen::MatrixXd::Zero(n, n);
  b.both = Eigen::MatrixXd::Zero(n, 6);
  b.camera_right = Eigen::VectorXd::Zero(n);
  for (const TagInPlane& tag : tags)
    for (std::size_t k = 0; k < 4; ++k) {
      const std::optional<PixelDerivative> at =
          pixel_derivative(camera, pose, {tag.in_plane[k].x(), tag.in_plane[k].y(), 0});
      if (!at) return std::nullopt;
      const Eigen::Vector2d error = at->pixel - tag.in_picture[k];
      constexpr double huber_px = 1;
      const double weight = error.norm() <= huber_px ? 1 : huber_px / error.norm();
      Eigen::Matrix<double, 2, 3> by_camera = Eigen::Matrix<double, 2, 3>::Zero();
      by_camera.col(0) = (at->pixel - Eigen::Vector2d(camera.cx(), camera.cy())) / camera.fx();
      by_camera(0, 1) = by_camera(1, 2) = 1;
      const Eigen::MatrixXd j = by_camera.leftCols(n);
      b.camera += weight * j.transpose() * j;
      b.both += weight * j.transpose() * at->by_pose;
      b.pose += weight * at->by_pose.transpose() * at->by_pose;
      b.camera_right -= weight * j.transpose() * error;
      b.pose_right -= weight * at->by_pose.transpose() * error;
      b.squares += weight * error.squaredNorm();
    }
  return b;
}

struct Solved {
  State state;
  Eigen::VectorXd sigma;  // of the camera's unknowns, pixels
  double rms_px = std::numeric_limits<double>::infinity();
};

// One Gauss–Newton step; nothing when it cannot be made. `solved` tells of the state before it.
bool step(const Problem& problem, Solved& solved) {
  std::vector<Block> blocks;
  double squares = 0, corners = 0;
  Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(problem.unknowns, problem.unknowns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(problem.unknowns);
  std::vector<Eigen::MatrixXd> pose_inverses;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const std::optional<Block> b =
        block_of(solved.state.camera, solved.state.poses[i], problem.views[i], problem.unknowns);
    const std::optional<Eigen::MatrixXd> inverse = b ? inverse_of_positive(b->pose) : std::nullopt;
    if (!inverse) return false;
    reduced += b->camera - b->both * *inverse * b->both.transpose();
    right += b->camera_right - b->both * *inverse * b->pose_right;
    squares += b->squares;
    corners += 4.0 * static_cast<double>(problem.views[i].size());
    blocks.push_back(*b);
    pose_inverses.push_back(*inverse);
  }
  const std::optional<Eigen::MatrixXd> covariance = inverse_of_positive(reduced);
  if (!covariance) return false;
  solved.rms_px = std::sqrt(squares / corners);
  solved.sigma = (std::max(squares / (2 * corners), 0.0025) * covariance->diagonal()).cwiseSqrt();
  const Eigen::VectorXd move = *covariance * right;
  std::array<double, CameraModel::parameter_count>& k = solved.state.camera.parameters;
  k[0] = k[1] = k[0] + move[0];
  if (problem.unknowns == 3) k[2] += move[1], k[3] += move[2];
  for (std::size_t i = 0; i < blocks.size(); ++i)
    solved.state.poses[i] =
        moved(solved.state.poses[i], pose_inverses[i] * (blocks[i].pose_right - blocks[i].both.transpose() * move));
  return k[0] > 0;
}

std::optional<Solved> adjusted(const Problem& problem, State start) {
  Solved solved{std::move(start), {}};
  constexpr int steps = 15;
  for (int i = 0; i < steps; ++i) {
    const double before = solved.rms_px;
    if (!step(problem, solved)) return std::nullopt;
    if (std::abs(before - solved.rms_px) < 1e-5 * solved.rms_px) break;
  }
  return solved;
}

CameraModel one_focal_length(CameraModel camera, bool centred) {
  std::array<double, CameraModel::parameter_count>& k = camera.parameters;
  k[0] = k[1] = std::sqrt(k[0] * k[1]);
  if (centred) k[2] = 0.5 * camera.width, k[3] = 0.5 * camera.height;
  return camera;
}

}  // namespace

QuickCamera::QuickCamera(MirrorTarget target, int width_px, int height_px, const QuickCameraOptions& options)
    : target_(std::move(target)), width_(width_px), height_(height_px), options_(options) {}

std::optional<QuickCamera::View> QuickCamera::view_of(std::span<const TagDetection> detections) const {
  std::vector<TagInPlane> tags;
  for (const TagDetection& detection : detections)
    if (const PlanarTag* tag = target_.find(detection.id)) tags.push_back({tag->corners_m(), detection.corners_px});
  const std::optional<RobustHomography> found = robust_homography(tags, options_.consensus_px);
  if (!found) return std::nullopt;
  View view{{}, found->picture_from_plane, {}};
  for (std::size_t i = 0; i < tags.size(); ++i)
    if (found->tag_is_inlier[i]) view.tags.push_back(tags[i]);
  if (view.tags.size() < static_cast<std::size_t>(options_.fewest_tags)) return std::nullopt;
  const double guess = 1.2 * std::max(width_, height_);  // any ordinary lens: only differences of tilt count
  const Eigen::Matrix3d k = (Eigen::Matrix3d() << guess, 0, 0.5 * width_, 0, guess, 0.5 * height_, 0, 0, 1).finished();
  const Eigen::Vector2d& corner = view.tags.front().in_plane[0];
  const std::optional<Rigid3> pose = pose_from_homography(view.picture_from_plane, {corner.x(), corner.y(), 0}, k);
  if (!pose) return std::nullopt;
  view.normal = pose->rotation * Eigen::Vector3d::UnitZ();
  return view;
}

bool QuickCamera::is_different(const View& view) const {
  const double cosine = std::cos(options_.differ_rad);
  return std::all_of(views_.begin(), views_.end(), [&](const View& v) { return v.normal.dot(view.normal) < cosine; });
}

void QuickCamera::add(std::span<const TagDetection> detections) {
  if (views() >= options_.most_views) return;
  std::optional<View> view = view_of(detections);
  if (!view || !is_different(*view)) return;
  views_.push_back(std::move(*view));
  if (views() >= options_.fewest_views) solve();
}

void QuickCamera::solve() {
  std::vector<Homography> homographies;
  Problem problem;
  for (const View& view : views_) {
    homographies.push_back(view.picture_from_plane);
    problem.views.emplace_back(view.tags);
  }
  const std::optional<CameraModel> closed = zhang_intrinsics(homographies, width_, height_);
  if (!closed) return;
  for (const bool centred : {false, true}) {
    State start{one_focal_length(*closed, centred), {}};
    for (const View& view : views_) {
      const Eigen::Vector2d& corner = view.tags.front().in_plane[0];
      const std::optional<Rigid3> pose =
          pose_from_homography(view.picture_from_plane, {corner.x(), corner.y(), 0}, start.camera.k_matrix());
      if (!pose) return;
      start.poses.push_back(*pose);
    }
    problem.unknowns = centred ? 1 : 3;
    const std::optional<Solved> solved = adjusted(problem, std::move(start));
    constexpr double most_rms_px = 2;  // more is no plane: printed wrong, or a lens that this model does not know
    if (!solved || solved->rms_px > most_rms_px) continue;
    if (!centred && solved->sigma.tail<2>().maxCoeff() > options_.most_centre_sigma * width_) continue;
    const double f = solved->state.camera.fx();
    if (solved->sigma[0] > options_.most_focal_sigma * f) continue;
    camera_ = solved->state.camera;
    return;
  }
}

}  // namespace mf
