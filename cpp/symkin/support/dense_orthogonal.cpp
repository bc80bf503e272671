// SPDX-License-Identifier: MIT

// The decompositions of dense.hpp by orthogonal maps.
#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <utility>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

using Eigen::MatrixXd;  // one storage order for all, so that each is compiled once

}  // namespace

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

PseudoInverse pseudo_inverse(const MatrixXd& matrix, double threshold) {
  const Index m = matrix.rows();
  const Index n = matrix.cols();
  if (m == 0) {  // Eigen reads past the end of a matrix without rows
    return {MatrixXd(n, 0), MatrixXd(0, 0)};
  }
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  qr.setThreshold(threshold);
  qr.compute(matrix);
  const Index rank = qr.rank();
  const MatrixXd q = qr.householderQ() * MatrixXd::Identity(m, m);
  MatrixXd inverse = MatrixXd::Zero(n, m);
  if (rank == n) {
    inverse =
        qr.matrixR().topRows(n).triangularView<Eigen::Upper>().solve(q.leftCols(n).transpose());
    inverse = qr.colsPermutation() * inverse;
  } else if (rank > 0) {
    const MatrixXd top = qr.matrixR().topRows(rank).triangularView<Eigen::Upper>();
    const MatrixXd gram = top * top.transpose();
    inverse = top.transpose() * gram.ldlt().solve(q.leftCols(rank).transpose());
    inverse = qr.colsPermutation() * inverse;
  }
  return {std::move(inverse), q.rightCols(m - rank)};
}

Vector least_squares(const MatrixXd& matrix, const Vector& right, double threshold) {
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
  solver.setThreshold(threshold);
  solver.compute(matrix);
  return solver.solve(right);
}

}  // namespace symkin
