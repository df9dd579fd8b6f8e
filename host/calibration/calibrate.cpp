// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/calibrate.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include "common/check.h"
#include "common/dense.h"
#include "common/error.h"
#include "common/robust_homography.h"
#include "common/zhang.h"
#include "host/calibration/bundle_adjustment.h"
#include "host/calibration/target_pose.h"

namespace mf {

namespace {

constexpr double degrees = std::numbers::pi / 180;
constexpr double chi2_8_median = 7.344;  // χ² with the eight degrees of a tag
constexpr double chi2_8_fifth = 11.03;   // exceeded by a fifth
constexpr double chi2_8_outlier = 50;    // exceeded once in 2·10⁷
constexpr int fewest_tags_to_calibrate = 2;

using Matrix8 = Eigen::Matrix<double, 8, 8>;

struct Pixels {
  double rms = 0;
  int corners = 0;
};

double tag_chi2(const CameraModel& camera, const Rigid3& pose, const TagSighting& tag, double* squared_px = nullptr) {
  Eigen::Matrix<double, 8, 1> r;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d x = pose * tag.corners_in_target[k];
    if (!(x.z() > 0)) return std::numeric_limits<double>::infinity();
    r.segment<2>(2 * static_cast<Eigen::Index>(k)) = camera.project(x) - tag.corners_px[k];
  }
  if (squared_px != nullptr) *squared_px = r.squaredNorm();
  return r.dot(tag.information * r);
}

Pixels reprojection(const CameraModel& camera, const Rigid3& pose, const TargetView& view) {
  double sum = 0;
  int corners = 0;
  for (const TagSighting& tag : view.tags) {
    double squared = 0;
    if (!tag.inlier || !std::isfinite(tag_chi2(camera, pose, tag, &squared))) continue;
    sum += squared;
    corners += 4;
  }
  return {corners > 0 ? std::sqrt(sum / corners) : 0, corners};
}

// What every corner shares on top of the picture's noise; a tag without any information is dropped.
void add_model_error(TargetView& view, double sigma_px) {
  std::vector<TagSighting> kept;
  for (TagSighting tag : view.tags) {
    std::optional<Eigen::MatrixXd> covariance = inverse_of_positive(tag.information);
    if (!covariance) continue;
    covariance->diagonal().array() += sigma_px * sigma_px;
    const std::optional<Eigen::MatrixXd> information = inverse_of_positive(*covariance);
    if (!information) continue;
    tag.information = *information;
    kept.push_back(tag);
  }
  view.tags = std::move(kept);
}

// The tags of the plane z = const that has the most of them.
std::vector<std::size_t> largest_plane(const TargetView& view) {
  std::vector<std::size_t> best;
  for (const TagSighting& first : view.tags) {
    std::vector<std::size_t> same;
    for (std::size_t i = 0; i < view.tags.size(); ++i)
      if (std::abs(view.tags[i].corners_in_target[0].z() - first.corners_in_target[0].z()) < 1e-9) same.push_back(i);
    if (same.size() > best.size()) best = same;
  }
  return best;
}

// One view on its way through the calibration.
struct Work {
  TargetView view;
  std::optional<Homography> homography;
  Eigen::Vector3d point_on_plane = Eigen::Vector3d::Zero();
  std::optional<PoseEstimate> pose;
};

void find_homography(Work& work, double threshold_px) {
  const std::vector<std::size_t> plane = largest_plane(work.view);
  std::vector<TagSighting> tags;
  tags.reserve(plane.size());
  for (const std::size_t i : plane) tags.push_back(work.view.tags[i]);
  const std::optional<RobustHomography> found = robust_homography(in_plane(tags), threshold_px);
  if (!found) return;
  for (std::size_t i = 0; i < plane.size(); ++i) {
    work.view.tags[plane[i]].inlier = found->tag_is_inlier[i];
    if (found->tag_is_inlier[i]) work.point_on_plane = tags[i].corners_in_target[0];
  }
  work.homography = found->picture_from_plane;
}

class Calibrator {
 public:
  Calibrator(const CalibrationInput& input, const CalibrationOptions& options, const Progress& progress)
      : input_(input), options_(options), progress_(progress) {
    threads_ =
        options.threads > 0 ? options.threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  }
  CalibrationResult run();

 private:
  void start();
  void pose_all();
  void adjust();
  void judge_tags();
  [[nodiscard]] bool drop_unseen_distortion();
  [[nodiscard]] MirrorPose mirror_pose(const Work&) const;
  [[nodiscard]] AdjustmentOptions adjustment_options() const;
  [[nodiscard]] std::vector<std::size_t> adjustable() const;
  void fill_world(Calibration&) const;

  const CalibrationInput& input_;
  const CalibrationOptions& options_;
  const Progress& progress_;
  int threads_ = 1;
  std::vector<Work> works_;  // the mirror frames, then the world
  std::array<bool, 5> free_distortion_{};
  Adjustment adjustment_;
  double variance_factor_ = 1;
};

AdjustmentOptions Calibrator::adjustment_options() const {
  AdjustmentOptions options;
  options.free_distortion = free_distortion_;
  options.square_pixels = options_.square_pixels;
  options.threads = threads_;
  return options;
}

void Calibrator::start() {
  for (const TargetView& view : input_.mirror) works_.push_back({view, {}, {}, {}});
  works_.push_back({input_.world, {}, {}, {}});
  std::vector<Homography> homographies;
  int well_seen = 0;
  constexpr int enough_tags = 4;  // a homography from fewer is mostly noise in what Zhang's constraints need
  for (Work& work : works_) {
    add_model_error(work.view, options_.model_error_px);
    find_homography(work, options_.ransac_threshold_px);
    well_seen += work.homography && work.view.inlier_count() >= enough_tags ? 1 : 0;
  }
  for (const Work& work : works_)
    if (work.homography && (work.view.inlier_count() >= enough_tags || well_seen < 3))
      homographies.push_back(*work.homography);
  if (homographies.empty())
    throw InputError(input_.source, "mirror frames",
                     "no frame shows the target's tags: check that target.json is the frame in the pictures, and that "
                     "the tags are sharp and not overexposed");
  const std::optional<CameraModel> camera = zhang_intrinsics(homographies, input_.width, input_.height);
  if (!camera)
    throw InputError(input_.source, "mirror frames",
                     fmt::format("the focal length cannot be found from {} frame(s): record some with the mirror "
                                 "tilted 30 degrees or more in different directions",
                                 homographies.size()));
  adjustment_.camera = *camera;
}

// Every view's pose under the camera of now, from its homography and, when there is one, from the pose it has.
void Calibrator::pose_all() {
  for (Work& work : works_) {
    if (!work.homography || work.view.inlier_count() == 0) {
      work.pose.reset();
      continue;
    }
    std::optional<PoseEstimate> best = work.pose;
    if (best) best = estimate_pose(adjustment_.camera, work.view, best->cam_from_target);
    if (!best) {
      const std::optional<Rigid3> from =
          pose_from_homography(*work.homography, work.point_on_plane, adjustment_.camera.k_matrix());
      if (from) best = estimate_pose(adjustment_.camera, work.view, *from);
    }
    work.pose = best;
  }
}

std::vector<std::size_t> Calibrator::adjustable() const {
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < works_.size(); ++i)
    if (works_[i].pose && works_[i].view.inlier_count() >= fewest_tags_to_calibrate) chosen.push_back(i);
  if (!chosen.empty()) return chosen;
  for (std::size_t i = 0; i < works_.size(); ++i)
    if (works_[i].pose && works_[i].view.inlier_count() > 0) chosen.push_back(i);
  return chosen;
}

void Calibrator::adjust() {
  const std::vector<std::size_t> chosen = adjustable();
  if (chosen.empty())
    throw InputError(input_.source, "mirror frames", "no frame's pose fits its tags: check target.json's sizes");
  std::vector<TargetView> views;
  std::vector<Rigid3> poses;
  for (const std::size_t i : chosen) {
    views.push_back(works_[i].view);
    poses.push_back(works_[i].pose->cam_from_target);
  }
  adjustment_ = adjust_bundle(adjustment_.camera, views, poses, adjustment_options());
  for (std::size_t k = 0; k < chosen.size(); ++k)
    works_[chosen[k]].pose->cam_from_target = adjustment_.poses[k].cam_from_target;
}

// Scales the information so that χ² is distributed as it should be, then marks the tags far out.
void Calibrator::judge_tags() {
  std::vector<double> all;
  for (const Work& work : works_)
    if (work.pose)
      for (const TagSighting& tag : work.view.tags)
        all.push_back(tag_chi2(adjustment_.camera, work.pose->cam_from_target, tag));
  if (all.empty()) return;
  std::sort(all.begin(), all.end());
  // The upper fifth too: real corners have heavier tails than the median tells, and those far out in a distorted
  // picture, which say most about the lens, are the first to look like outliers.
  constexpr double least = 1e-6;  // perfect, made-up corners: no noise to scale by
  const double factor = std::max({all[all.size() / 2] / chi2_8_median, all[all.size() * 4 / 5] / chi2_8_fifth, least});
  variance_factor_ *= factor;
  for (Work& work : works_)
    for (TagSighting& tag : work.view.tags) {
      tag.information /= factor;
      if (work.pose) tag.inlier = tag_chi2(adjustment_.camera, work.pose->cam_from_target, tag) < chi2_8_outlier;
    }
}

// Wald's test of each group of terms against zero, the highest order first; true when something was dropped.
bool Calibrator::drop_unseen_distortion() {
  static const std::vector<std::vector<int>> groups{{8}, {6, 7}, {4, 5}};  // k3; p1 p2; k1 k2
  constexpr double significant = 25;                                       // five standard deviations
  for (const std::vector<int>& group : groups) {
    if (!free_distortion_[static_cast<std::size_t>(group[0] - 4)]) continue;
    Eigen::VectorXd value(static_cast<Eigen::Index>(group.size()));
    for (std::size_t i = 0; i < group.size(); ++i)
      value[static_cast<Eigen::Index>(i)] = adjustment_.camera.parameters[static_cast<std::size_t>(group[i])];
    const Eigen::MatrixXd covariance = adjustment_.camera_covariance(group, group);
    const std::optional<Eigen::MatrixXd> solved = solve_symmetric(covariance, value);
    if (!solved || value.dot(solved->col(0)) > significant) {
      if (group[0] == 8) return false;  // k3 is real: so are the radial terms below it; tangential ones stay too
      continue;
    }
    for (const int parameter : group) {
      free_distortion_[static_cast<std::size_t>(parameter - 4)] = false;
      adjustment_.camera.parameters[static_cast<std::size_t>(parameter)] = 0;
    }
    return true;
  }
  return false;
}

MirrorPose Calibrator::mirror_pose(const Work& work) const {
  MirrorPose out;
  out.name = work.view.name;
  const auto refuse = [&](std::string why) {
    out.why_not = std::move(why);
    return out;
  };
  if (work.view.tags.empty()) return refuse("no tag found");
  if (!work.pose) return refuse("no pose fits its tags");
  const CameraModel& camera = adjustment_.camera;
  const AdjustedPose pose = pose_with_covariance(adjustment_, work.view, work.pose->cam_from_target);
  const Pixels error = reprojection(camera, pose.cam_from_target, work.view);
  out.rms_px = error.rms;
  out.inlier_corners = error.corners;
  out.outlier_corners = 4 * static_cast<int>(work.view.tags.size()) - error.corners;
  if (error.corners == 0 || out.outlier_corners > out.inlier_corners) return refuse("its tags contradict each other");
  out.rotation_sigma_rad = std::sqrt(pose.covariance.topLeftCorner<3, 3>().trace());
  out.position_sigma_m = std::sqrt(pose.covariance.bottomRightCorner<3, 3>().trace());
  if (!(pose.cam_from_target.inverse().translation.z() > 0)) return refuse("the camera is behind the mirror");
  // Twice the log-likelihood ratio below which the other tilt cannot be excluded.
  constexpr double clearly_worse = 25;
  if (2 * (work.pose->mirrored_cost - work.pose->cost) < clearly_worse) return refuse("two poses fit its tags alike");
  if (!(out.rotation_sigma_rad <= options_.max_rotation_sigma_deg * degrees) ||
      !(out.position_sigma_m <= options_.max_position_sigma_m))
    return refuse(fmt::format("its pose is uncertain: {:.2f} deg, {:.1f} mm from {} tag(s)",
                              out.rotation_sigma_rad / degrees, 1e3 * out.position_sigma_m, error.corners / 4));
  out.cam_from_mirror = pose.cam_from_target;
  out.used = true;
  return out;
}

void Calibrator::fill_world(Calibration& calibration) const {
  const Work& world = works_.back();
  if (!world.pose || world.view.inlier_count() == 0) return;
  const AdjustedPose pose = pose_with_covariance(adjustment_, world.view, world.pose->cam_from_target);
  calibration.cam_from_world = pose.cam_from_target;
  calibration.world_rms_px = reprojection(adjustment_.camera, pose.cam_from_target, world.view).rms;
  calibration.world_rotation_sigma_rad = std::sqrt(pose.covariance.topLeftCorner<3, 3>().trace());
  calibration.world_position_sigma_m = std::sqrt(pose.covariance.bottomRightCorner<3, 3>().trace());
}

CalibrationResult Calibrator::run() {
  const DistortionChoice choice = options_.distortion;
  const bool k12 = choice != DistortionChoice::none;
  const bool p12 = k12 && choice != DistortionChoice::radial;
  const bool k3 = choice == DistortionChoice::full || choice == DistortionChoice::automatic;
  free_distortion_ = {k12, k12, p12, p12, k3};
  report_progress(progress_, "calibrating", 0);
  start();
  pose_all();
  constexpr int rounds = 3;
  for (int round = 0; round < rounds; ++round) {
    adjust();
    judge_tags();
    pose_all();
    report_progress(progress_, "calibrating", (round + 1.0) / (rounds + 1));
  }
  adjust();
  if (choice == DistortionChoice::automatic)
    while (drop_unseen_distortion()) adjust();
  judge_tags();
  pose_all();
  adjust();
  pose_all();
  CalibrationResult result;
  Calibration& out = result.calibration;
  out.camera = adjustment_.camera;
  for (int i = 0; i < CameraModel::parameter_count; ++i)
    out.camera_sigma[static_cast<std::size_t>(i)] = std::sqrt(adjustment_.camera_covariance(i, i));
  double squares = 0, corners = 0;
  for (std::size_t i = 0; i + 1 < works_.size(); ++i) {
    out.frames.push_back(mirror_pose(works_[i]));
    const MirrorPose& frame = out.frames.back();
    result.tags += static_cast<int>(works_[i].view.tags.size());
    result.outlier_tags += frame.outlier_corners / 4;
    if (!frame.used) continue;
    squares += frame.inlier_corners * frame.rms_px * frame.rms_px;
    corners += frame.inlier_corners;
  }
  if (corners == 0)
    throw InputError(
        input_.source, "mirror frames",
        fmt::format("none of {} could be posed (the first: {}): check target.json and the light on the tags",
                    out.frames.size(), out.frames.empty() ? "there is none" : out.frames.front().why_not));
  out.rms_px = corners > 0 ? std::sqrt(squares / corners) : 0;
  result.noise_factor = std::sqrt(variance_factor_);
  fill_world(out);
  out.options = {{"distortion", distortion_choice_name(choice)},
                 {"square_pixels", options_.square_pixels ? "true" : "false"},
                 {"ransac_threshold_px", fmt::format("{}", options_.ransac_threshold_px)},
                 {"model_error_px", fmt::format("{}", options_.model_error_px)},
                 {"max_rotation_sigma_deg", fmt::format("{}", options_.max_rotation_sigma_deg)},
                 {"max_position_sigma_m", fmt::format("{}", options_.max_position_sigma_m)}};
  report_progress(progress_, "calibrating", 1);
  return result;
}

}  // namespace

std::string distortion_choice_name(DistortionChoice choice) {
  switch (choice) {
    case DistortionChoice::automatic:
      return "automatic";
    case DistortionChoice::none:
      return "none";
    case DistortionChoice::radial:
      return "radial";
    case DistortionChoice::brown:
      return "brown";
    case DistortionChoice::full:
      return "full";
  }
  check(false, "every distortion choice has a name");
  return {};
}

std::optional<DistortionChoice> parse_distortion_choice(std::string_view name) {
  for (const DistortionChoice choice : {DistortionChoice::automatic, DistortionChoice::none, DistortionChoice::radial,
                                        DistortionChoice::brown, DistortionChoice::full})
    if (name == distortion_choice_name(choice)) return choice;
  return std::nullopt;
}

std::optional<std::string> CalibrationOptions::validate() const {
  if (!(ransac_threshold_px > 0)) return "ransac_threshold_px must be positive";
  if (!(model_error_px > 0)) return "model_error_px must be positive";
  if (!(max_rotation_sigma_deg > 0)) return "max_rotation_sigma_deg must be positive";
  if (!(max_position_sigma_m > 0)) return "max_position_sigma_m must be positive";
  if (threads < 0) return "threads must be 0 or more";
  return std::nullopt;
}

CalibrationResult calibrate(const CalibrationInput& input, const CalibrationOptions& options,
                            const Progress& progress) {
  const std::optional<std::string> fault = options.validate();
  check(!fault, fault.value_or(""));
  return Calibrator(input, options, progress).run();
}

}  // namespace mf
