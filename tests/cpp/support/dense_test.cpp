// SPDX-License-Identifier: MIT
#include "symkin/support/dense.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

namespace symkin {
namespace {

// Rows of any number of columns, in units that differ by many orders of magnitude.
RowMatrix rows(Index columns) {
  RowMatrix matrix(20, columns);
  for (Index i = 0; i < matrix.rows(); ++i) {
    for (Index j = 0; j < columns; ++j) {
      const auto k = static_cast<double>(i * columns + j);
      matrix(i, j) = std::sin(k * k) * std::pow(10.0, static_cast<double>(j % 4));
    }
  }
  return matrix;
}

TEST(Dense, CholeskyOfAWeightedSquareSolvesAndInverts) {
  for (Index columns = 3; columns <= 10; ++columns) {
    const RowMatrix matrix = rows(columns);
    const Vector weights = Vector::LinSpaced(20, 0.5, 2);
    const RowMatrix expected = matrix.transpose() * weights.asDiagonal() * matrix;
    RowMatrix square;
    weighted_square(matrix, weights, square);
    EXPECT_LT((RowMatrix(square.triangularView<Eigen::Lower>()) -
               RowMatrix(expected.triangularView<Eigen::Lower>()))
                  .norm(),
              1e-12 * expected.norm());
    ScaledCholesky cholesky;
    cholesky.compute(square);
    EXPECT_GT(cholesky.least_pivot(), 1e-3);
    const RowMatrix unit = cholesky.inverse() * expected;
    EXPECT_LT((unit - RowMatrix::Identity(columns, columns)).cwiseAbs().maxCoeff(), 1e-9);
    const Vector right = expected.col(0) + expected.col(2);
    Vector solution;
    cholesky.solve(right, solution);
    EXPECT_LT((solution - Vector::Unit(columns, 0) - Vector::Unit(columns, 2)).norm(), 1e-9);
    EXPECT_NEAR(cholesky.inverse_form(right) / right.dot(solution), 1, 1e-10);
  }
}

TEST(Dense, CholeskyOfDependentColumnsHasNoPivotLeft) {
  RowMatrix matrix = rows(4);
  matrix.col(3) = 1e5 * matrix.col(1);
  RowMatrix square;
  weighted_square(matrix, Vector::Ones(20), square);
  ScaledCholesky cholesky;
  cholesky.compute(square);
  EXPECT_LT(cholesky.least_pivot(), 1e-14);
  cholesky.compute(square, 1e-4);  // damped
  EXPECT_GT(cholesky.least_pivot(), 1e-5);
}

}  // namespace
}  // namespace symkin
