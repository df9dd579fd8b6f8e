// SPDX-License-Identifier: Apache-2.0
#include "common/zhang.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/dense.h"

namespace mf {

namespace {

// Homographies to pixels centred and divided by the picture's size, of unit column length: a well-scaled system.
std::vector<Eigen::Matrix3d> normalized(std::span<const Homography> homographies, int width_px, int height_px) {
  const double scale = 1.0 / (width_px + height_px);
  const Eigen::Matrix3d n =
      (Eigen::Matrix3d() << scale, 0, -scale * 0.5 * width_px, 0, scale, -scale * 0.5 * height_px, 0, 0, 1).finished();
  std::vector<Eigen::Matrix3d> out;
  for (const Homography& h : homographies) {
    Eigen::Matrix3d m = n * h.matrix;
    m /= std::sqrt(m.col(0).norm() * m.col(1).norm());
    if (m.allFinite()) out.push_back(m);
  }
  return out;
}

// Zhang's v_ij without the skew's term: b = (B11, B22, B13, B23, B33).
Eigen::Matrix<double, 1, 5> constraint(const Eigen::Matrix3d& h, int i, int j) {
  return {h(0, i) * h(0, j), h(1, i) * h(1, j), h(2, i) * h(0, j) + h(0, i) * h(2, j),
          h(2, i) * h(1, j) + h(1, i) * h(2, j), h(2, i) * h(2, j)};
}

std::optional<Eigen::Vector4d> full_solution(const std::vector<Eigen::Matrix3d>& views) {
  if (views.size() < 3) return std::nullopt;
  Eigen::MatrixXd v(2 * static_cast<Eigen::Index>(views.size()), 5);
  for (std::size_t i = 0; i < views.size(); ++i) {
    v.row(2 * static_cast<Eigen::Index>(i)) = constraint(views[i], 0, 1);
    v.row(2 * static_cast<Eigen::Index>(i) + 1) = constraint(views[i], 0, 0) - constraint(views[i], 1, 1);
  }
  const NullVector null = null_vector(v);
  constexpr double rank_tolerance = 1e-6;
  if (null.singular_values(3) < rank_tolerance * null.singular_values(0)) return std::nullopt;
  const Eigen::VectorXd b = null.vector * (null.vector(4) < 0 ? -1.0 : 1.0);
  const double cx = -b(2) / b(0);
  const double cy = -b(3) / b(1);
  const double lambda = b(4) - b(2) * b(2) / b(0) - b(3) * b(3) / b(1);
  if (!(lambda / b(0) > 0) || !(lambda / b(1) > 0)) return std::nullopt;
  const Eigen::Vector4d k(std::sqrt(lambda / b(0)), std::sqrt(lambda / b(1)), cx, cy);
  const bool plausible = k.allFinite() && std::abs(cx) < 0.25 && std::abs(cy) < 0.25 &&
                         std::abs(std::log(k[0] / k[1])) < 0.7;  // the centre inside the picture, pixels not 2 : 1
  return plausible ? std::optional(k) : std::nullopt;
}

// With the centre known: h1ᵀ diag(q, q, 1) h2 = 0 and equal lengths are linear in q = 1/f².
std::optional<Eigen::Vector4d> centred_solution(const std::vector<Eigen::Matrix3d>& views) {
  double aa = 0, ab = 0;
  for (const Eigen::Matrix3d& h : views) {
    const Eigen::Vector3d p = h.col(0), q = h.col(1);
    const Eigen::Vector2d a(p.head<2>().dot(q.head<2>()), p.head<2>().squaredNorm() - q.head<2>().squaredNorm());
    const Eigen::Vector2d b(-p.z() * q.z(), q.z() * q.z() - p.z() * p.z());
    aa += a.squaredNorm();
    ab += a.dot(b);
  }
  const double inverse_square = aa > 0 ? ab / aa : 0;
  const double f = inverse_square > 0 ? 1 / std::sqrt(inverse_square) : 0;
  constexpr double shortest = 0.1, longest = 50;  // of width + height: fish-eye to telescope
  if (!(f > shortest && f < longest)) return std::nullopt;
  return Eigen::Vector4d(f, f, 0, 0);
}

}  // namespace

std::optional<CameraModel> zhang_intrinsics(std::span<const Homography> picture_from_plane, int width_px,
                                            int height_px) {
  const std::vector<Eigen::Matrix3d> views = normalized(picture_from_plane, width_px, height_px);
  std::optional<Eigen::Vector4d> k = full_solution(views);
  if (!k) k = centred_solution(views);
  if (!k) return std::nullopt;
  const double scale = width_px + height_px;
  CameraModel camera;
  camera.width = width_px;
  camera.height = height_px;
  camera.parameters = {(*k)[0] * scale,
                       (*k)[1] * scale,
                       (*k)[2] * scale + 0.5 * width_px,
                       (*k)[3] * scale + 0.5 * height_px,
                       0,
                       0,
                       0,
                       0,
                       0};
  return camera;
}

}  // namespace mf
