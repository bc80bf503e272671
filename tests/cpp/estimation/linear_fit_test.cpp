// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/linear_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr Index kRows = 20;
constexpr Index kColumns = 5;

RowMatrix random_rows(std::uint64_t seed) {
  Random random(seed);
  RowMatrix rows(kRows, kColumns);
  for (Index i = 0; i < kRows; ++i) {
    for (Index k = 0; k < kColumns; ++k) {
      rows(i, k) = random.normal();
    }
  }
  return rows;
}

// The last column follows from the others but for so much of its own; in units far apart.
RowMatrix dependent_rows(double own) {
  RowMatrix rows = random_rows(3);
  const Vector alone = rows.col(4);
  rows.col(4) = rows.leftCols(4) * Vector::LinSpaced(4, -1, 2) + own * alone;
  return rows * Vector::LinSpaced(kColumns, 1, 1e4).asDiagonal();
}

LinearFit of_square(const RowMatrix& rows, const Vector& sizes, int* asked = nullptr,
                    bool by_rows = false) {
  const auto ask = [&rows, asked] {
    if (asked != nullptr) {
      ++*asked;
    }
    return rows;
  };
  return {rows.transpose() * rows, sizes, ask, by_rows};
}

double difference(const RowMatrix& a, const RowMatrix& b) {
  const Vector scale = b.diagonal().cwiseSqrt().cwiseInverse();
  return (scale.asDiagonal() * (a - b) * scale.asDiagonal()).cwiseAbs().maxCoeff();
}

// Of the estimate on which A z = 0, by its free coordinates.
RowMatrix held_covariance(const RowMatrix& rows, const RowMatrix& held) {
  const RightSingular svd = right_singular(held);
  const RowMatrix free = svd.vectors.rightCols(held.cols() - held.rows());
  const RowMatrix own = rows * free;
  return free * inverse(own.transpose() * own) * free.transpose();
}

TEST(LinearFit, AsksTheRowsOnlyWhereTheirSquareHidesSomething) {
  int asked = 0;
  const RowMatrix clear = random_rows(1);
  const LinearFit fit = of_square(clear, Vector::Ones(kColumns), &asked);
  EXPECT_TRUE(fit.clear());
  EXPECT_EQ(fit.rank(), kColumns);
  EXPECT_EQ(asked, 0);
  // Nothing of the last column: the square shows that as clearly.
  const Vector sizes = Vector::LinSpaced(kColumns, 1, 1e4).cwiseInverse();
  EXPECT_EQ(of_square(dependent_rows(0), sizes, &asked).rank(), kColumns - 1);
  EXPECT_EQ(asked, 0);
  // So little that squaring loses it.
  EXPECT_EQ(of_square(dependent_rows(1e-5), sizes, &asked).rank(), kColumns);
  EXPECT_EQ(asked, 1);
}

TEST(LinearFit, CountsAsUnseenWhatIsBelowOneBillionthOfTheLargest) {
  const Vector ones = Vector::Ones(kRows);
  for (const auto& [own, rank] : {std::pair{1e-7, kColumns}, std::pair{1e-12, kColumns - 1}}) {
    const RowMatrix rows = dependent_rows(own);
    const LinearFit fit(rows, ones);
    EXPECT_FALSE(fit.clear());
    EXPECT_EQ(fit.rank(), rank);
    EXPECT_EQ(std::isfinite(fit.condition()), rank == kColumns);
    EXPECT_EQ(fit.covariance().allFinite(), rank == kColumns);
  }
  const RowMatrix rows = dependent_rows(0);
  const RowMatrix unseen = LinearFit(rows, ones).named_unseen();
  ASSERT_EQ(unseen.cols(), 1);
  EXPECT_NEAR(unseen.norm(), 1, 1e-12);
  EXPECT_LT((rows * unseen).norm(), 1e-9 * rows.norm());
}

TEST(LinearFit, HasTheCovarianceOfTheEstimateThatIsHeld) {
  const Vector sizes = Vector::LinSpaced(kColumns, 1, 1e4).cwiseInverse();
  RowMatrix held(1, kColumns);
  held << 1, -2, 3, 0.5, 40;
  const RowMatrix rows = dependent_rows(0);
  for (const bool by_rows : {false, true}) {
    const LinearFit fit = of_square(rows, sizes, nullptr, by_rows);
    EXPECT_LT(difference(fit.covariance(held), held_covariance(rows, held)), 1e-8);
    EXPECT_TRUE(std::isinf(fit.covariance()(0, 0)));
  }
  // Where the rows themselves have to tell what is unseen: one more direction that is nearly so.
  RowMatrix nearly = rows;
  nearly.col(0) = nearly.col(1) + 1e-5 * nearly.col(0);
  const LinearFit asked = of_square(nearly, sizes);
  ASSERT_EQ(asked.unseen().cols(), 1);
  EXPECT_LT(difference(asked.covariance(held), held_covariance(nearly, held)), 1e-5);
}

TEST(LinearFit, SaysTheSameByRowsAndByTheirSquare) {
  const RowMatrix rows = random_rows(7);
  const Vector factors = random_rows(8).col(0);
  const LinearFit fit(rows, factors);
  const RowMatrix own = factors.asDiagonal() * rows;
  EXPECT_LT(difference(of_square(own, Vector::Ones(kColumns)).covariance(), fit.covariance()),
            1e-13);
  const RowMatrix influence = fit.influence();
  EXPECT_LT((influence * rows - RowMatrix::Identity(kColumns, kColumns)).cwiseAbs().maxCoeff(),
            1e-12);
}

TEST(LinearFit, SplitsResidualsInBothOfItsWays) {
  const Vector residual = random_rows(11).col(2);
  for (const double own : {1.0, 1e-6}) {
    const RowMatrix rows = dependent_rows(own);
    const Vector scale = inverse_column_lengths(rows);
    const RowMatrix basis = column_space(rows * scale.asDiagonal()).basis;
    const LinearFit fit(rows, Vector::Ones(kRows));
    EXPECT_EQ(fit.clear(), own == 1);
    EXPECT_NEAR(fit.explained(residual), (basis.transpose() * residual).squaredNorm(), 1e-8);
    EXPECT_NEAR(fit.leverages().sum(), kColumns, 1e-8);
    EXPECT_LT((fit.leverages() - basis.rowwise().squaredNorm()).cwiseAbs().maxCoeff(), 1e-8);
  }
}

}  // namespace
}  // namespace symkin
