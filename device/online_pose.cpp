// SPDX-License-Identifier: Apache-2.0
#include "device/online_pose.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/dense.h"
#include "common/plane_pose.h"
#include "common/robust_homography.h"
#include "device/pixel_derivative.h"

namespace mf {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct SeenTag {
  std::array<Eigen::Vector3d, 4> in_target;
  std::array<Eigen::Vector2d, 4> in_picture;
};

// AprilTag's order runs counter-clockwise on the page, where y is down; on a ghost it runs the other way.
bool is_seen_from_its_front(const std::array<Eigen::Vector2d, 4>& c) {
  const Eigen::Vector2d a = c[2] - c[0], b = c[3] - c[1];
  return b.x() * a.y() - b.y() * a.x() > 0;
}

struct Fit {
  Rigid3 pose;
  double cost = std::numeric_limits<double>::infinity();  // Σ ρ(|error|²), px²
  double squares = 0;                                     // Σ |error|², px²
  Matrix6 information = Matrix6::Zero();                  // for corners of one pixel's standard deviation
};

// Cost and normal equations at a pose. Infinite cost when a corner lies behind the camera.
Vector6 accumulate(const CameraModel& camera, std::span<const SeenTag> tags, double huber_px, Fit& fit) {
  Vector6 right = Vector6::Zero();
  fit.cost = fit.squares = 0;
  fit.information.setZero();
  for (const SeenTag& tag : tags)
    for (std::size_t k = 0; k < 4; ++k) {
      const std::optional<PixelDerivative> at = pixel_derivative(camera, fit.pose, tag.in_target[k]);
      if (!at) {
        fit.cost = std::numeric_limits<double>::infinity();
        return right;
      }
      const Eigen::Vector2d error = at->pixel - tag.in_picture[k];
      const double size = error.norm();
      const double weight = size <= huber_px ? 1 : huber_px / size;
      fit.squares += size * size;
      fit.cost += size <= huber_px ? size * size : 2 * huber_px * size - huber_px * huber_px;
      const Eigen::Matrix<double, 6, 2> jt = weight * at->by_pose.transpose();
      fit.information += jt.lazyProduct(at->by_pose);
      right -= jt * error;
    }
  return right;
}

// Gauss–Newton from a start that is already close; a step that makes it worse is halved.
Fit refined(const CameraModel& camera, std::span<const SeenTag> tags, const Rigid3& start, double huber_px) {
  Fit best;
  best.pose = start;
  Vector6 right = accumulate(camera, tags, huber_px, best);
  constexpr int most_steps = 12;
  for (int i = 0; i < most_steps && std::isfinite(best.cost); ++i) {
    const std::optional<Eigen::MatrixXd> step = solve_symmetric(best.information, right);
    if (!step) break;
    Fit trial;
    double share = 1;
    Vector6 trial_right;
    for (; share > 0.05; share *= 0.5) {
      trial.pose = moved(best.pose, share * *step);
      trial_right = accumulate(camera, tags, huber_px, trial);
      if (trial.cost <= best.cost) break;
    }
    if (!(trial.cost <= best.cost)) break;
    const bool settled = best.cost - trial.cost < 1e-5 * best.cost;
    best = trial;
    right = trial_right;
    if (settled) break;
  }
  return best;
}

// The tags of the plane z = const that has the most of them.
std::vector<std::size_t> tags_of_largest_plane(std::span<const SeenTag> tags) {
  std::vector<std::size_t> best;
  for (const SeenTag& first : tags) {
    std::vector<std::size_t> same;
    for (std::size_t i = 0; i < tags.size(); ++i)
      if (std::abs(tags[i].in_target[0].z() - first.in_target[0].z()) < 1e-9) same.push_back(i);
    if (same.size() > best.size()) best = same;
  }
  return best;
}

// Without lens distortion, in normalized image coordinates.
std::optional<TagInPlane> undistorted(const SeenTag& tag, const CameraModel& camera) {
  TagInPlane out;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::optional<Eigen::Vector3d> ray = camera.unproject(tag.in_picture[k]);
    if (!ray) return std::nullopt;
    out.in_plane[k] = tag.in_target[k].head<2>();
    out.in_picture[k] = ray->head<2>();
  }
  return out;
}

struct Start {
  Rigid3 pose;
  std::vector<SeenTag> tags;  // that agree on it
};

std::optional<Start> closed_form(std::span<const SeenTag> tags, const CameraModel& camera, double consensus_px) {
  std::vector<TagInPlane> flat;
  std::vector<SeenTag> sources;
  for (const std::size_t i : tags_of_largest_plane(tags))
    if (const std::optional<TagInPlane> tag = undistorted(tags[i], camera)) {
      flat.push_back(*tag);
      sources.push_back(tags[i]);
    }
  const double focal = std::sqrt(camera.fx() * camera.fy());
  const std::optional<RobustHomography> found = robust_homography(flat, consensus_px / focal);
  if (!found) return std::nullopt;
  Start start;
  for (std::size_t i = 0; i < sources.size(); ++i)
    if (found->tag_is_inlier[i]) start.tags.push_back(sources[i]);
  const std::optional<Rigid3> pose =
      pose_from_homography(found->picture_from_plane, start.tags.front().in_target[0], Eigen::Matrix3d::Identity());
  if (!pose) return std::nullopt;
  start.pose = *pose;
  return start;
}

Eigen::Vector3d centre_of(std::span<const SeenTag> tags) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SeenTag& tag : tags)
    for (const Eigen::Vector3d& corner : tag.in_target) sum += corner;
  return sum / static_cast<double>(4 * tags.size());
}

// Largest standard deviation of a rotation, radians, for corners as noisy as their errors say (a tenth of a pixel at
// least: few corners fit too well by luck).
double rotation_sigma(const Fit& fit, std::size_t corners) {
  const std::optional<Eigen::MatrixXd> covariance = inverse_of_positive(fit.information);
  if (!covariance) return std::numeric_limits<double>::infinity();
  const double freedom = std::max(1.0, 2.0 * static_cast<double>(corners) - 6);
  const double variance = std::max(0.01, fit.squares / freedom);
  return std::sqrt(variance * covariance->diagonal().head<3>().maxCoeff());
}

std::optional<OnlinePose> pose_of(std::span<const SeenTag> tags, const CameraModel& camera,
                                  const OnlinePoseOptions& options) {
  if (tags.size() < static_cast<std::size_t>(options.fewest_tags)) return std::nullopt;
  const std::optional<Start> start = closed_form(tags, camera, options.consensus_px);
  if (!start || start->tags.size() < static_cast<std::size_t>(options.fewest_tags)) return std::nullopt;
  const Fit first = refined(camera, start->tags, start->pose, options.huber_px);
  const Fit second = refined(camera, start->tags, mirrored_tilt(first.pose, centre_of(start->tags)), options.huber_px);
  const Fit& best = second.cost < first.cost ? second : first;
  const Fit& other = second.cost < first.cost ? first : second;
  if (!std::isfinite(best.cost)) return std::nullopt;
  constexpr double same_minimum_rad = 1e-3;
  const bool two_minima = std::isfinite(other.cost) && rotation_angle_between(best.pose, other.pose) > same_minimum_rad;
  const std::size_t corners = 4 * start->tags.size();
  // What fits to a twentieth of a pixel fits perfectly: of two such poses none is sure.
  const double least = 0.0025 * static_cast<double>(corners);
  if (two_minima && other.cost < options.surely * options.surely * std::max(best.cost, least)) return std::nullopt;
  const double rms = std::sqrt(best.squares / static_cast<double>(corners));
  if (rms > options.most_rms_px || rotation_sigma(best, corners) > options.most_rotation_sigma) return std::nullopt;
  if (!(best.pose.inverse().translation.z() > 0)) return std::nullopt;  // seen from behind
  return OnlinePose{best.pose, rms, static_cast<int>(start->tags.size())};
}

}  // namespace

std::optional<OnlinePose> online_mirror_pose(std::span<const TagDetection> detections, const MirrorTarget& target,
                                             const CameraModel& camera, const OnlinePoseOptions& options) {
  std::vector<SeenTag> tags;
  for (const TagDetection& detection : detections) {
    const PlanarTag* tag = target.find(detection.id);
    if (tag == nullptr || !is_seen_from_its_front(detection.corners_px)) continue;
    SeenTag seen{{}, detection.corners_px};
    const std::array<Eigen::Vector2d, 4> corners = tag->corners_m();
    for (std::size_t k = 0; k < 4; ++k) seen.in_target[k] = {corners[k].x(), corners[k].y(), 0};
    tags.push_back(seen);
  }
  return pose_of(tags, camera, options);
}

namespace {

constexpr std::size_t enough_samples = 25;
constexpr int frames_that_tell = 10;

std::array<Eigen::Vector2d, 4> median(const std::vector<std::array<Eigen::Vector2d, 4>>& samples) {
  std::array<Eigen::Vector2d, 4> out;
  std::vector<double> values(samples.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  for (std::size_t k = 0; k < 4; ++k)
    for (const int axis : {0, 1}) {
      for (std::size_t i = 0; i < samples.size(); ++i) values[i] = samples[i][k][axis];
      std::nth_element(values.begin(), middle, values.end());
      out[k][axis] = *middle;
    }
  return out;
}

}  // namespace

WorldPoseEstimate::WorldPoseEstimate(WorldTarget target, const OnlinePoseOptions& options)
    : target_(std::move(target)), options_(options) {
  // One large tag flat on the table is worth a pose when nothing else is there: its certainty decides.
  options_.fewest_tags = std::min(options_.fewest_tags, static_cast<int>(target_.tags.size()));
}

// Whether most of the known tags that are seen lie elsewhere; nothing when none is seen.
std::optional<bool> WorldPoseEstimate::elsewhere(std::span<const TagDetection> tags) const {
  int known = 0, away = 0;
  for (const TagDetection& tag : tags) {
    const auto samples = samples_.find(tag.id);
    if (samples == samples_.end() || samples->second.size() < enough_samples) continue;
    if (!is_seen_from_its_front(tag.corners_px)) continue;
    ++known;
    const Corners at = median(samples->second);
    away += (at[0] - tag.corners_px[0]).norm() > options_.consensus_px ? 1 : 0;
  }
  return known > 0 ? std::optional(2 * away > known) : std::nullopt;
}

void WorldPoseEstimate::add(std::span<const TagDetection> tags, const CameraModel& camera) {
  if (const std::optional<bool> away = elsewhere(tags)) frames_elsewhere_ = *away ? frames_elsewhere_ + 1 : 0;
  if (frames_elsewhere_ >= frames_that_tell) {
    samples_.clear();
    pose_.reset();
    frames_elsewhere_ = 0;
    ++times_moved_;
  }
  bool learned = false;
  for (const TagDetection& tag : tags) {
    if (target_.find(tag.id) == nullptr || !is_seen_from_its_front(tag.corners_px)) continue;
    std::vector<Corners>& samples = samples_[tag.id];
    if (samples.size() >= enough_samples) continue;
    samples.push_back(tag.corners_px);
    learned = true;
  }
  if (learned) estimate(camera);
}

void WorldPoseEstimate::estimate(const CameraModel& camera) {
  std::vector<SeenTag> tags;
  for (const auto& [id, samples] : samples_) tags.push_back({target_.find(id)->corners_in_world(), median(samples)});
  if (const std::optional<OnlinePose> pose = pose_of(tags, camera, options_)) pose_ = pose;
}

}  // namespace mf
