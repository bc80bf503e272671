// SPDX-License-Identifier: MIT
#include "symkin/support/dense.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/support/null_directions.hpp"

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

// A reflection that mixes all axes.
RowMatrix turn(Index n) {
  const Vector axis = Vector::LinSpaced(n, 1, 2).normalized();
  return RowMatrix::Identity(n, n) - 2 * axis * axis.transpose();
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

TEST(Dense, WhatASquareTakesToZeroIsFoundWhereItIsClear) {
  RowMatrix matrix = rows(6);
  matrix.col(5) = matrix.col(1) - 10 * matrix.col(0);
  const RowMatrix square = matrix.transpose() * matrix;
  const auto null = clear_null_space(square, 1e-6);
  ASSERT_TRUE(null.has_value());
  ASSERT_EQ(null->cols(), 1);
  EXPECT_LT((matrix * *null).norm(), 1e-9 * matrix.norm() * null->norm());
  EXPECT_EQ(clear_null_space(rows(4).transpose() * rows(4), 1e-6)->cols(), 0);
  matrix.col(5) += 1e-4 * matrix.col(5).norm() * Vector::Unit(20, 3);  // neither
  EXPECT_FALSE(clear_null_space(matrix.transpose() * matrix, 1e-6).has_value());
}

TEST(Dense, PseudoInverseObeysPenroseWhateverTheRank) {
  for (const auto& [m, n] : {std::pair<Index, Index>{7, 4}, {4, 7}, {5, 5}, {1, 3}}) {
    for (Index rank = 0; rank <= std::min(m, n); ++rank) {
      RowMatrix a = RowMatrix::Zero(m, n);
      for (Index k = 0; k < rank; ++k) {
        a(k, n - 1 - k) = 1.0 + static_cast<double>(k);
      }
      a = (turn(m) * a * turn(n)).eval();
      const auto [x, left_null] = pseudo_inverse(a, 1e-9);
      EXPECT_LT((a * x * a - a).norm(), 1e-12);
      EXPECT_LT((x * a * x - x).norm(), 1e-12);
      EXPECT_LT((a * x - (a * x).transpose()).norm(), 1e-12);
      EXPECT_LT((x * a - (x * a).transpose()).norm(), 1e-12);
      EXPECT_EQ(left_null.cols(), m - rank);
      EXPECT_LT((left_null.transpose() * a).norm(), 1e-12);
    }
  }
}

TEST(Dense, CholeskyFactorIsEmptyWhereThereIsNone) {
  const RowMatrix matrix = rows(4);
  const RowMatrix square = matrix.transpose() * matrix;
  const RowMatrix factor = cholesky_factor(square);
  EXPECT_LT((factor * factor.transpose() - square).norm(), 1e-12 * square.norm());
  EXPECT_EQ(factor(0, 3), 0);
  const RowMatrix unit = lower_solution(factor, factor);
  EXPECT_LT((unit - RowMatrix::Identity(4, 4)).norm(), 1e-9);
  EXPECT_LT((lower_solution(factor, factor.col(1)) - Vector::Unit(4, 1)).norm(), 1e-9);
  EXPECT_EQ(cholesky_factor(-square).size(), 0);
}

TEST(Dense, ThePseudoInverseOfASymmetricMatrixTakesRoundingForZero) {
  const RowMatrix some = rows(5).topRows(3);
  const RowMatrix square = some.transpose() * some;  // of rank 3, its other eigenvalues +-rounding
  const SymmetricInverse found = symmetric_inverse(square);
  EXPECT_EQ(found.rank, 3);
  const RowMatrix projector = found.matrix * square;
  EXPECT_NEAR(projector.trace(), 3, 1e-6);
  EXPECT_LT((square * projector - square).norm(), 1e-6 * square.norm());
}

TEST(Dense, TheCoordinatesOfAColumnSpaceLeadToItsBasis) {
  RowMatrix matrix = rows(6);
  matrix.col(4) = matrix.col(0) + 2 * matrix.col(1);
  const ColumnSpace space = column_space(matrix, 1e-9);
  EXPECT_EQ(space.rank(), 5);
  EXPECT_LT((matrix * space.coordinates - space.basis).norm(), 1e-9);
  EXPECT_LT((space.basis.transpose() * space.basis - RowMatrix::Identity(5, 5)).norm(), 1e-12);
}

TEST(NamedDirections, AreInTheUnitsOfTheScaleAndFewParametersLong) {
  // In scaled units parameters 0 and 1 go together, and 2 by itself; given as a mixture of both.
  RowMatrix directions(3, 2);
  directions << 1, 1, 1, 1, 1, -1;
  const RowMatrix named = named_directions(directions, Eigen::Vector3d(3, 4, 7));
  RowMatrix sorted = named.cwiseAbs();
  if (sorted(2, 0) > 0.5) {
    sorted.col(0).swap(sorted.col(1));
  }
  RowMatrix expected(3, 2);
  expected << 0.6, 0, 0.8, 0, 0, 1;
  EXPECT_LT((sorted - expected).norm(), 1e-14) << named;
}

}  // namespace
}  // namespace symkin
