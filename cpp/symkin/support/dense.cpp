// SPDX-License-Identifier: MIT
#include "symkin/support/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <limits>

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

ColumnSpace column_space(const RowMatrix& matrix, double least_pivot) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(matrix);
  const Vector pivots = qr.matrixR().diagonal().cwiseAbs();
  const Index rank = least_pivot > 0 ? (pivots.array() > least_pivot).count() : qr.rank();
  MatrixXd inverse_r = MatrixXd::Identity(rank, rank);
  qr.matrixR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>().solveInPlace(inverse_r);
  MatrixXd coordinates = MatrixXd::Zero(matrix.cols(), rank);
  coordinates.topRows(rank) = inverse_r;
  return {qr.householderQ() * MatrixXd::Identity(matrix.rows(), rank),
          qr.colsPermutation() * coordinates};
}

Vector inverse_column_lengths(const RowMatrix& matrix) {
  const Vector lengths = matrix.colwise().norm();
  return (lengths.array() > 0).select(lengths, 1).cwiseInverse();
}

SymmetricInverse symmetric_inverse(const RowMatrix& matrix) {
  const SymmetricEigen eigen = symmetric_eigen(matrix);
  const Index n = matrix.rows();
  const double least = static_cast<double>(n) * std::numeric_limits<double>::epsilon() *
                       eigen.values.cwiseAbs().maxCoeff();
  const Index rank = (eigen.values.array() > least).count();
  const RowMatrix half = eigen.vectors.rightCols(rank) *
                         eigen.values.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
  return {half * half.transpose(), rank};
}

double determinant(const RowMatrix& matrix) {
  return Eigen::PartialPivLU<RowMatrix>(matrix).determinant();
}

RowMatrix inverse(const RowMatrix& matrix) {
  return Eigen::PartialPivLU<RowMatrix>(matrix).inverse();
}

}  // namespace symkin
