// SPDX-License-Identifier: Apache-2.0
#include "common/dense.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace mf {

using Eigen::MatrixXd;

std::optional<MatrixXd> solve_symmetric(const Eigen::Ref<const MatrixXd>& a, const Eigen::Ref<const MatrixXd>& b) {
  const Eigen::LDLT<MatrixXd> ldlt(a);
  if (ldlt.info() != Eigen::Success) return std::nullopt;
  MatrixXd x = ldlt.solve(b);
  return x.allFinite() ? std::optional(std::move(x)) : std::nullopt;
}

std::optional<MatrixXd> inverse_of_positive(const Eigen::Ref<const MatrixXd>& a) {
  const Eigen::LDLT<MatrixXd> ldlt(a);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0)) return std::nullopt;
  MatrixXd inverse = MatrixXd::Identity(a.rows(), a.cols());
  ldlt.solveInPlace(inverse);
  return inverse;
}

std::optional<MatrixXd> inverse_of(const Eigen::Ref<const MatrixXd>& a) {
  const Eigen::FullPivLU<MatrixXd> lu(a);
  if (!lu.isInvertible()) return std::nullopt;
  return MatrixXd(lu.inverse());
}

NullVector null_vector(const Eigen::Ref<const MatrixXd>& a) {
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeFullV);
  return {svd.matrixV().col(a.cols() - 1), svd.singularValues()};
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<MatrixXd> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU().lazyProduct(svd.matrixV().transpose());
}

}  // namespace mf
