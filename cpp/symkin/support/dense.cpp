// SPDX-License-Identifier: MIT
#include "symkin/support/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace symkin {
namespace {

// One storage order for all, so that each decomposition is compiled once.
using Eigen::MatrixXd;

}  // namespace

SymmetricEigen symmetric_eigen(const RowMatrix& matrix) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(matrix);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Vector symmetric_eigenvalues(const RowMatrix& matrix) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

RowMatrix inverse_factor(const RowMatrix& matrix) {
  RowMatrix factor = RowMatrix::Identity(matrix.rows(), matrix.cols());
  const Eigen::LLT<RowMatrix> cholesky(matrix);
  if (cholesky.info() != Eigen::Success) {
    return {};
  }
  cholesky.matrixL().solveInPlace(factor);
  if (!factor.allFinite()) {
    return {};
  }
  return factor;
}

double log_determinant(const RowMatrix& factor) {
  return -2 * factor.diagonal().array().log().sum();
}

// With matrix = F^T F, the orthogonal Q of F = Q T is taken off from the last column backwards.
RowMatrix lower_root(const RowMatrix& matrix) {
  const SymmetricEigen eigen = symmetric_eigen(matrix);
  const RowMatrix root =
      eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
  return triangular_factor(root.rowwise().reverse()).reverse();
}

RowMatrix lower_inverse(const RowMatrix& lower) {
  RowMatrix result = RowMatrix::Identity(lower.rows(), lower.cols());
  lower.triangularView<Eigen::Lower>().solveInPlace(result);
  return result;
}

RowMatrix triangular_factor(const RowMatrix& matrix) {
  const Eigen::HouseholderQR<MatrixXd> qr(matrix);
  return qr.matrixQR().topRows(matrix.cols()).triangularView<Eigen::Upper>();
}

RightSingular right_singular(const RowMatrix& matrix) {
  const Eigen::JacobiSVD<MatrixXd> svd(matrix, Eigen::ComputeFullV);
  return {svd.singularValues(), svd.matrixV()};
}

Vector singular_values(const RowMatrix& matrix) {
  return Eigen::JacobiSVD<MatrixXd>(matrix).singularValues();
}

double determinant(const RowMatrix& matrix) {
  return Eigen::PartialPivLU<RowMatrix>(matrix).determinant();
}

RowMatrix inverse(const RowMatrix& matrix) {
  return Eigen::PartialPivLU<RowMatrix>(matrix).inverse();
}

}  // namespace symkin
