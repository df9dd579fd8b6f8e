// SPDX-License-Identifier: Apache-2.0
#include "common/robust_homography.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace mf {

namespace {

struct Corners {
  std::vector<Eigen::Vector2d> plane;
  std::vector<Eigen::Vector2d> picture;
};

Corners corners_of(std::span<const TagInPlane> tags, const std::vector<bool>& chosen) {
  Corners corners;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    if (!chosen[i]) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      corners.plane.push_back(tags[i].in_plane[k]);
      corners.picture.push_back(tags[i].in_picture[k]);
    }
  }
  return corners;
}

std::vector<bool> inliers_of(const Homography& h, std::span<const TagInPlane> tags, double threshold) {
  std::vector<bool> inlier(tags.size());
  for (std::size_t i = 0; i < tags.size(); ++i) {
    double worst = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d q = h.matrix * tags[i].in_plane[k].homogeneous();
      worst = std::max(worst, std::abs(q.z()) < 1e-12 ? INFINITY : (q.hnormalized() - tags[i].in_picture[k]).norm());
    }
    inlier[i] = worst <= threshold;
  }
  return inlier;
}

// The four corners of one tag fix a homography, but a small one: take them from up to four tags.
std::optional<Homography> sample_homography(std::span<const TagInPlane> tags, std::mt19937& random) {
  std::vector<Eigen::Vector2d> plane, picture;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t i = tags.size() == 1 ? 0 : random() % tags.size();
    // Corner k of the k-th tag: four corners of one tag are then never three on a line.
    plane.push_back(tags[i].in_plane[k]);
    picture.push_back(tags[i].in_picture[k]);
  }
  return fit_homography(plane, picture);
}

}  // namespace

std::optional<RobustHomography> robust_homography(std::span<const TagInPlane> tags, double threshold) {
  if (tags.empty()) return std::nullopt;
  std::mt19937 random(1);
  std::vector<bool> best(tags.size());
  std::ptrdiff_t best_count = 0;
  int trials = tags.size() == 1 ? 1 : 200;
  for (int trial = 0; trial < trials; ++trial) {
    const std::optional<Homography> h = sample_homography(tags, random);
    if (!h) continue;
    std::vector<bool> inlier = inliers_of(*h, tags, threshold);
    const std::ptrdiff_t count = std::count(inlier.begin(), inlier.end(), true);
    if (count <= best_count) continue;
    best_count = count;
    best = std::move(inlier);
    // As many trials as find a sample without outliers with 99.9 % probability.
    const double share = static_cast<double>(count) / static_cast<double>(tags.size());
    const double clean = std::min(std::pow(share, 4), 1 - 1e-9);
    trials = std::min(trials, static_cast<int>(std::ceil(std::log(1e-3) / std::log(1 - clean))) + 4);
  }
  // Least squares on the inliers finds more of them; twice settles it.
  std::optional<Homography> fitted;
  for (int i = 0; i < 2 && best_count > 0; ++i) {
    const Corners corners = corners_of(tags, best);
    fitted = fit_homography(corners.plane, corners.picture);
    if (!fitted) return std::nullopt;
    best = inliers_of(*fitted, tags, threshold);
    best_count = std::count(best.begin(), best.end(), true);
  }
  if (!fitted || best_count == 0) return std::nullopt;
  return RobustHomography{*fitted, best};
}

}  // namespace mf
