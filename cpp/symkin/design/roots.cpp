// SPDX-License-Identifier: MIT
#include "symkin/design/roots.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace symkin {

// With matrix = F^T F, the orthogonal Q of F = Q T is taken off from the last column backwards.
RowMatrix lower_root(const RowMatrix& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  const Eigen::MatrixXd root =
      eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(root.rowwise().reverse());
  const Eigen::MatrixXd upper = qr.matrixQR().triangularView<Eigen::Upper>();
  return upper.reverse();
}

}  // namespace symkin
