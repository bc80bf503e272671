// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numeric>
#include <optional>

#include "design/small_problems.hpp"
#include "symkin/design/detail/candidates.hpp"
#include "symkin/design/detail/criteria.hpp"
#include "symkin/design/detail/information.hpp"
#include "symkin/design/detail/row_columns.hpp"
#include "symkin/design/detail/row_variances.hpp"
#include "symkin/support/dense.hpp"

namespace symkin::testing {
namespace {

using design::CandidateRows;
using design::RowsInMemory;
using design::detail::BestPair;
using design::detail::Candidates;
using design::detail::ColumnBlocks;
using design::detail::error_gain;
using design::detail::Indices;
using design::detail::Information;
using design::detail::Leaving;
using design::detail::leaving_pose;
using design::detail::Products;
using design::detail::RowColumns;
using design::detail::RowVariances;
using design::detail::Shape;
using design::detail::variances;

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

TEST(Updates, AnExchangeOfRowsChangesTheErrorAsAFreshFactorSays) {
  const Index p = 6;
  const RowMatrix rows = random_rows(24, p, 4);
  const RowMatrix information = rows.transpose() * rows;
  const RowMatrix half = random_rows(p, p, 5);
  const RowMatrix weight = half.transpose() * half;
  const RowMatrix inverse = information.inverse();
  const RowMatrix in = random_rows(3, p, 6);
  const RowMatrix out = rows.topRows(3);
  const RowMatrix weighted = inverse * weight * inverse;
  const RowMatrix solved[] = {in * inverse, out * inverse};
  const RowMatrix weighed[] = {in * weighted, out * weighted};
  const std::optional<double> gain =
      error_gain({in, solved[0], weighed[0]}, {out, solved[1], weighed[1]});
  const RowMatrix after = information + in.transpose() * in - out.transpose() * out;
  const double error = (inverse * weight).trace();
  ASSERT_TRUE(gain);
  EXPECT_NEAR(*gain, error - (after.inverse() * weight).trace(), 1e-9 * error);
  const RowMatrix none = RowMatrix::Zero(24, p);
  const RowMatrix all_solved = rows * inverse;
  const RowMatrix all_weighed = rows * weighted;
  EXPECT_FALSE(error_gain({none, none, none}, {rows, all_solved, all_weighed}));
}

TEST(Screen, OfEqualCandidatesKeepsThoseOfLowerIndex) {
  const RowMatrix one = random_rows(50, 3, 6);
  RowMatrix rows(400, 3);
  rows << one, one, one, one, one, one, one, one;
  const design::CandidateRows all{rows};
  const design::RowsInMemory source{all};
  const design::detail::Candidates candidates(source, {}, 1, Index{1} << 20);
  const auto best =
      design::detail::screen_candidates(candidates, {{RowMatrix::Identity(3, 3), 4}}).front();
  ASSERT_EQ(best.size(), 4U);
  for (const design::detail::RankedCandidate& each : best) {  // the first half of eight twins
    EXPECT_EQ(each.index % 50, best.front().index % 50);
    EXPECT_LT(each.index, 200);
  }
}

struct Known {
  Index rows;
  bool apart;  // each row knows parameters of its own alone, as those of a whole mechanism's legs
  bool mixed = false;  // by a lower triangular matrix, as noise that legs have in common does it
};

class Kernel : public ::testing::TestWithParam<Known> {
 protected:
  static constexpr Index kParameters = 15;   // some vectors are taken at once, some are left
  static constexpr Index kCandidates = 300;  // more than a block

  Kernel()
      : shape{GetParam().rows, kParameters},
        rows(made_rows(kCandidates * shape.rows, 4)),
        x(rows, shape.rows),
        products(x) {
    const RowMatrix start = made_rows(60, 5);
    matrix = start.transpose() * start;
  }

  RowMatrix made_rows(Index count, std::uint64_t seed) const {
    RowMatrix made = random_rows(count, kParameters, seed);
    for (Index i = 0; i < made.size() && GetParam().apart; ++i) {
      const Index row = i / kParameters % shape.rows;
      const Index column = i % kParameters;
      made.data()[i] *= column * shape.rows / kParameters == row ? 1 : 0;
    }
    for (Index first = 0; first + shape.rows <= count && GetParam().mixed; first += shape.rows) {
      const RowMatrix factors = random_rows(shape.rows, shape.rows, 100 + seed + first);
      made.middleRows(first, shape.rows) =
          (factors.triangularView<Eigen::Lower>() * made.middleRows(first, shape.rows)).eval();
    }
    return made;
  }

  RowMatrix candidate(Index j) const { return rows.middleRows(j * shape.rows, shape.rows); }

  void expect_products_of(const RowMatrix& inverse) const {
    double largest = 0;
    for (Index j = 0; j < kCandidates; ++j) {
      const RowMatrix d = candidate(j) * inverse * candidate(j).transpose();
      ASSERT_NEAR(products.trace(j), d.trace(), 1e-10);
      ASSERT_LT((products.of(j) - d).cwiseAbs().maxCoeff(), 1e-10);
      largest = std::max(largest, d.trace());
    }
    EXPECT_NEAR(products.trace(products.largest()), largest, 1e-10);
  }

  Shape shape;
  RowMatrix rows;
  ColumnBlocks x;
  Products products;
  RowMatrix matrix;
};

TEST_P(Kernel, ProductsAgreeWithDenseAlgebra) {
  products.compute(inverse_factor(matrix));
  expect_products_of(matrix.inverse());
  const Vector d = variances(x, inverse_factor(matrix));
  ASSERT_EQ(d.size(), kCandidates);
  for (Index j = 0; j < kCandidates; ++j) {
    ASSERT_NEAR(d[j], products.trace(j), 1e-10);
    ASSERT_EQ(x.rows(j), candidate(j));
  }
}

TEST_P(Kernel, UpdatedProductsAgreeWithDenseAlgebra) {
  products.compute(inverse_factor(matrix));
  Information information(matrix);
  const RowMatrix added = made_rows(7, 6);
  products.update(information.add(added.data(), 7, 0.5));
  matrix += 0.5 * added.transpose() * added;
  expect_products_of(matrix.inverse());
  products.set(7, RowMatrix::Constant(shape.rows, shape.rows, 1e3));
  EXPECT_EQ(products.trace(products.largest()), 1e3 * static_cast<double>(shape.rows));
}

TEST_P(Kernel, VariancesOfRowsBoundTheDeterminantsForEachInverse) {
  const CandidateRows given{rows, shape.rows};
  const RowsInMemory source(given);
  const Candidates candidates(source, {}, 1, 1 << 20U);
  Indices all(kCandidates);
  std::iota(all.begin(), all.end(), Index{0});
  const RowColumns columns(candidates, all);
  const Index mixing = GetParam().mixed ? shape.rows * (shape.rows - 1) / 2 : 0;
  EXPECT_EQ(columns.form().width, kParameters * (GetParam().apart ? 1 : shape.rows) + mixing);
  RowVariances variances(columns, 2);
  Information information(matrix);
  variances.compute(0, inverse_factor(matrix));
  variances.compute(1, inverse_factor(4 * matrix));
  variances.pass();
  const RowMatrix added = made_rows(7, 6);
  variances.update(0, information.add(added.data(), 7, 0.5));
  variances.update(0, information.add(made_rows(3, 5).data(), 3, -0.5));
  variances.pass();
  const RowMatrix inverses[] = {information.inverse(), matrix.inverse() / 4};
  for (const Index which : {0, 1}) {
    std::vector<double> largest(variances.largest(which).size(), 1);
    for (Index j = 0; j < kCandidates; ++j) {
      const RowMatrix d = candidate(j) * inverses[which] * candidate(j).transpose();
      const double product = (1 + d.diagonal().array()).prod();
      ASSERT_NEAR(variances.bound(which, j), product, 1e-10 * product);
      const RowMatrix root = columns.times(j, inverse_factor(inverses[which].inverse()));
      ASSERT_LT((root * root.transpose() - d).norm(), 1e-10 * d.norm());
      double& most = largest[static_cast<std::size_t>(j / design::detail::kGroup)];
      most = std::max(most, product);
    }
    for (std::size_t group = 0; group < largest.size(); ++group) {
      ASSERT_NEAR(variances.largest(which)[group], largest[group], 1e-10 * largest[group]);
    }
  }
}

TEST_P(Kernel, TheBestExchangeIsThatOfLargestDeterminantAndNotOfAHiddenCandidate) {
  const RowMatrix out = candidate(17);
  matrix += out.transpose() * out;
  const RowMatrix inverse = matrix.inverse();
  products.compute(inverse_factor(matrix));
  const Leaving leaving = leaving_pose(out, out * inverse);
  Index hidden = -1;
  for (int turn = 0; turn < 2; ++turn) {
    BestPair best;
    products.best_pair(leaving, best);
    double ratio = 0;
    Index lane = -1;
    for (Index j = 0; j < kCandidates; ++j) {
      const RowMatrix in = candidate(j);
      const double value =
          std::exp(log_det(matrix + in.transpose() * in - out.transpose() * out) - log_det(matrix));
      if (value > ratio && j != hidden) {
        ratio = value;
        lane = j;
      }
    }
    EXPECT_EQ(best.candidate, lane);
    EXPECT_NEAR(best.ratio, ratio, 1e-6 * ratio);
    products.hide(lane);
    hidden = lane;
  }
}

INSTANTIATE_TEST_SUITE_P(Updates, Kernel,
                         ::testing::Values(Known{1, false}, Known{2, false}, Known{3, false},
                                           Known{2, true}, Known{3, true}, Known{2, true, true},
                                           Known{3, true, true}));

}  // namespace
}  // namespace symkin::testing
