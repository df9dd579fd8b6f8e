// SPDX-License-Identifier: Apache-2.0
#include "common/homography.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "common/check.h"
#include "common/dense.h"

namespace mf {

namespace {

// Moves the centroid to 0 and scales the mean distance to √2, which makes the system well conditioned.
Eigen::Matrix3d normalizing_transform(std::span<const Eigen::Vector2d> points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  double distance = 0;
  for (const Eigen::Vector2d& p : points) distance += (p - mean).norm();
  distance /= static_cast<double>(points.size());
  const double scale = distance > 0 ? std::sqrt(2.0) / distance : 1.0;
  return (Eigen::Matrix3d() << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1).finished();
}

}  // namespace

Homography Homography::inverse() const {
  const Eigen::Matrix3d back = matrix.inverse();
  return {back / back.norm()};
}

std::optional<Homography> fit_homography(std::span<const Eigen::Vector2d> source,
                                         std::span<const Eigen::Vector2d> target) {
  check(source.size() == target.size(), "a homography needs as many target as source points");
  if (source.size() < 4) return std::nullopt;
  const Eigen::Matrix3d normalize_source = normalizing_transform(source);
  const Eigen::Matrix3d normalize_target = normalizing_transform(target);
  Eigen::MatrixXd a(2 * static_cast<Eigen::Index>(source.size()), 9);
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Eigen::RowVector3d x = (normalize_source * source[i].homogeneous()).transpose();
    const Eigen::Vector3d y = normalize_target * target[i].homogeneous();
    const Eigen::Index r = 2 * static_cast<Eigen::Index>(i);
    a.row(r) << x, Eigen::RowVector3d::Zero(), -y.x() * x;
    a.row(r + 1) << Eigen::RowVector3d::Zero(), x, -y.y() * x;
  }
  const NullVector null = null_vector(a);
  constexpr double rank_tolerance = 1e-9;  // relative; a second null vector means that the points leave H open
  if (null.singular_values(7) < rank_tolerance * null.singular_values(0)) return std::nullopt;
  const Eigen::VectorXd& h = null.vector;
  const Eigen::Matrix3d normalized =
      (Eigen::Matrix3d() << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), h(8)).finished();
  const Eigen::Matrix3d matrix = normalize_target.inverse() * normalized * normalize_source;
  if (!matrix.allFinite() || std::abs(normalized.determinant()) < rank_tolerance) return std::nullopt;
  return Homography{matrix / matrix.norm()};
}

}  // namespace mf
