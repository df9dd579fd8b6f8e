// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

namespace mf {

// Decompositions of small dense matrices (up to some dozens of rows), compiled once for any size: Eigen's templates for
// each fixed size would be a good part of a first build. Not for inner loops over pixels.

// x of a x = b by LDLᵀ, for a symmetric `a` (its lower half is read). Nothing when x is not finite.
[[nodiscard]] std::optional<Eigen::MatrixXd> solve_symmetric(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                                             const Eigen::Ref<const Eigen::MatrixXd>& b);

// Inverse of a symmetric positive definite matrix: a covariance from an information matrix. Nothing for another one.
[[nodiscard]] std::optional<Eigen::MatrixXd> inverse_of_positive(const Eigen::Ref<const Eigen::MatrixXd>& a);

// Inverse of a square matrix by LU with full pivoting. Nothing when it is singular to working precision.
[[nodiscard]] std::optional<Eigen::MatrixXd> inverse_of(const Eigen::Ref<const Eigen::MatrixXd>& a);

// The unit vector that `a` (rows ≥ columns − 1) shrinks most, by singular values.
struct NullVector {
  Eigen::VectorXd vector;
  Eigen::VectorXd singular_values;  // falling
};
[[nodiscard]] NullVector null_vector(const Eigen::Ref<const Eigen::MatrixXd>& a);

// The rotation nearest to `m` in the Frobenius norm, for det(m) > 0.
[[nodiscard]] Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

}  // namespace mf
