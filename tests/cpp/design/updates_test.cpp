// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "design/small_problems.hpp"
#include "symkin/design/information.hpp"
#include "symkin/design/kernels.hpp"
#include "symkin/design/leaving_pose.hpp"
#include "symkin/design/roots.hpp"

namespace symkin::testing {
namespace {

TEST(Updates, RankOneUpdatesAgreeWithRecomputation) {
  const RowMatrix rows = random_rows(400, 6, 1);
  RowMatrix matrix = rows.topRows(20).transpose() * rows.topRows(20);
  Information information(matrix);
  for (Index k = 20; k < 400; ++k) {
    information.add(rows.row(k).data(), 1, 1);
    information.add(rows.row(k - 20).data(), 1, -1);
    matrix +=
        rows.row(k).transpose() * rows.row(k) - rows.row(k - 20).transpose() * rows.row(k - 20);
    ASSERT_NEAR(information.log_det(), log_det(matrix), 1e-9) << "update " << k;
    ASSERT_LT((information.inverse() * matrix - RowMatrix::Identity(6, 6)).norm(), 1e-8);
  }
}

TEST(Updates, TakingAwayWhatNothingReplacesIsNoticed) {
  const RowMatrix rows = random_rows(4, 4, 2);
  Information information(rows.transpose() * rows);
  ASSERT_TRUE(information.positive_definite());
  information.add(rows.row(0).data(), 1, -1);
  EXPECT_LT(information.log_det(), -20);
  information.add(rows.row(0).data(), 1, 1);
  EXPECT_NEAR(information.log_det(), log_det(rows.transpose() * rows), 1e-6);
}

TEST(Updates, ALowerRootOfASingularMatrixMultipliesBack) {
  const RowMatrix half = random_rows(2, 5, 3);
  const RowMatrix matrix = half.transpose() * half;
  const RowMatrix root = lower_root(matrix);
  EXPECT_LT((root.transpose() * root - matrix).norm(), 1e-12 * matrix.norm());
  EXPECT_EQ(RowMatrix(root.triangularView<Eigen::StrictlyUpper>()).norm(), 0);
}

class Kernel : public ::testing::TestWithParam<Index> {
 protected:
  static constexpr Index kParameters = 5;
  static constexpr Index kCandidates = 200;

  Kernel()
      : shape{GetParam(), kParameters},
        rows(random_rows(kCandidates * shape.rows, kParameters, 4)),
        x(kCandidates, shape.width()),
        gram(shape.gram_size() * kBlock),
        trace(kBlock),
        group_max(kGroups) {
    for (Index j = 0; j < kCandidates; ++j) {
      x.set(j, rows.middleRows(j * shape.rows, shape.rows).eval().data());
    }
    const RowMatrix start = random_rows(30, kParameters, 5);
    matrix = start.transpose() * start;
  }

  RowMatrix candidate(Index j) const { return rows.middleRows(j * shape.rows, shape.rows); }

  void expect_products_of(const RowMatrix& inverse) const {
    for (Index j = 0; j < kCandidates; ++j) {
      const RowMatrix d = candidate(j) * inverse * candidate(j).transpose();
      ASSERT_NEAR(trace[j], d.trace(), 1e-10);
      ASSERT_GE(group_max[j / kGroup], trace[j]);
      for (Index a = 0, pair = 0; shape.rows > 1 && a < shape.rows; ++a) {
        for (Index b = 0; b <= a; ++b, ++pair) {
          ASSERT_NEAR(gram[pair * kBlock + j], d(a, b), 1e-10);
        }
      }
    }
  }

  Shape shape;
  RowMatrix rows;
  ColumnBlocks x;
  AlignedArray gram, trace, group_max;
  RowMatrix matrix;
};

TEST_P(Kernel, ProductsAgreeWithDenseAlgebra) {
  kernels().gram(x.block(0), inverse_factor(matrix).data(), shape, gram.data(), trace.data(),
                 group_max.data());
  expect_products_of(matrix.inverse());
}

TEST_P(Kernel, UpdatedProductsAgreeWithDenseAlgebra) {
  kernels().gram(x.block(0), inverse_factor(matrix).data(), shape, gram.data(), trace.data(),
                 group_max.data());
  const Vector added = random_rows(1, kParameters, 6).transpose();
  const Vector u = matrix.inverse() * added;
  kernels().gram_update(x.block(0), u.data(), -1 / (1 + added.dot(u)), shape, gram.data(),
                        trace.data(), group_max.data());
  matrix += added * added.transpose();
  expect_products_of(matrix.inverse());
}

TEST_P(Kernel, TheSumOfOuterProductsAgreesWithDenseAlgebra) {
  RowMatrix sum = RowMatrix::Zero(kParameters, kParameters);
  kernels().outer_sum(x.block(0), shape, sum.data());
  const RowMatrix lower = (rows.transpose() * rows).triangularView<Eigen::Lower>();
  EXPECT_LT((sum - lower).norm(), 1e-10);
}

TEST_P(Kernel, TheBestExchangeIsThatOfLargestDeterminant) {
  const RowMatrix out = candidate(17);
  matrix += out.transpose() * out;
  const Information information(matrix);
  kernels().gram(x.block(0), inverse_factor(matrix).data(), shape, gram.data(), trace.data(),
                 group_max.data());
  LeavingPose leaving(shape);
  leaving.prepare(information, out.data());
  BestPair best;
  kernels().best_pair(x.block(0), gram.data(), trace.data(), group_max.data(), leaving.view(),
                      shape, best);
  double ratio = 0;
  Index lane = -1;
  for (Index j = 0; j < kCandidates; ++j) {
    const RowMatrix in = candidate(j);
    const double value =
        std::exp(log_det(matrix + in.transpose() * in - out.transpose() * out) - log_det(matrix));
    ASSERT_NEAR(leaving.ratio(information, in.data()), value, 1e-6 * value);
    if (value > ratio) {
      ratio = value;
      lane = j;
    }
  }
  EXPECT_EQ(best.lane, lane);
  EXPECT_NEAR(best.ratio, ratio, 1e-6 * ratio);
}

INSTANTIATE_TEST_SUITE_P(Updates, Kernel, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace symkin::testing
