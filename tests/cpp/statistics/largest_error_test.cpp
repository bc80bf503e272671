// SPDX-License-Identifier: MIT
#include "symkin/statistics/largest_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "statistics/promised_numbers.hpp"
#include "symkin/statistics/distributions.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

using testing::kLargestError;

// The effects of the reference, for parameters of covariance one.
struct Effects {
  RowMatrix rows;
  Index rows_per_pose;
  RowMatrix covariance;
};

Effects reference() {
  const auto& poses = kLargestError.effects;
  const auto per_pose = static_cast<Index>(poses.front().size());
  const auto columns = static_cast<Index>(poses.front().front().size());
  RowMatrix rows(static_cast<Index>(poses.size()) * per_pose, columns);
  Index row = 0;
  for (const auto& pose : poses) {
    for (const auto& numbers : pose) {
      rows.row(row++) = Eigen::Map<const Vector>(numbers.data(), columns).transpose();
    }
  }
  return {rows, per_pose, RowMatrix::Identity(columns, columns)};
}

double bound(const Effects& given, const LargestErrorOptions& options = {}) {
  return largest_errors(given.rows, given.rows_per_pose, 1, given.covariance, options)[0];
}

TEST(LargestError, IsThatOfTheReferenceWithinTheErrorOfItsDraws) {
  const double relative = bound(reference()) / kLargestError.simulated_95 - 1;
  EXPECT_LT(std::abs(relative), 3 * std::hypot(kLargestError.relative_tolerance, 0.007));
}

TEST(LargestError, LiesBetweenTheLargestSinglePoseAndTheSumOfAll) {
  const double found = bound(reference());
  EXPECT_GT(found, kLargestError.largest_pose_95);
  EXPECT_LT(found, kLargestError.union_95);
}

TEST(LargestError, OfOnePoseIsTheQuantileOfItsForm) {
  Effects given = reference();
  given.rows = RowMatrix(given.rows.topRows(given.rows_per_pose));
  const QuadraticForm form =
      QuadraticForm::of(given.rows.transpose() * given.rows, given.covariance);
  EXPECT_NEAR(bound(given) / std::sqrt(form.quantile(0.95)), 1, 0.02);
  LargestErrorOptions estimated;
  estimated.noise_degrees = 6.5;
  EXPECT_NEAR(bound(given, estimated) / std::sqrt(form.quantile(0.95, 6.5)), 1, 0.02);
}

TEST(LargestError, TakesThePosesWhereItIsLargestOnAverage) {
  LargestErrorOptions worst;
  worst.poses = 12;
  Effects first = reference();
  first.rows = RowMatrix(first.rows.topRows(12 * first.rows_per_pose));
  EXPECT_GT(bound(reference(), worst), 0.97 * bound(reference()));
  EXPECT_GT(bound(reference(), worst), bound(first));
}

TEST(LargestError, OfSeveralCovariancesLiesBetweenThoseOfEach) {
  Effects given = reference();
  const Index size = given.covariance.rows();
  RowMatrix both(2 * size, size);
  both << given.covariance, 4 * given.covariance;
  const double one = bound(given);
  given.covariance = both;
  EXPECT_GT(bound(given), 1.7 * one);  // those of the larger exceed its 90%
  EXPECT_LT(bound(given), 2.0 * one);
}

TEST(LargestError, IsTheSameEveryTime) { EXPECT_EQ(bound(reference()), bound(reference())); }

TEST(LargestError, RefusesWhatDoesNotFit) {
  Effects given = reference();
  given.rows_per_pose = 3;
  EXPECT_THROW(bound(given), InvalidInput);
  given = reference();
  given.covariance = RowMatrix::Identity(2, 2);
  EXPECT_THROW(bound(given), InvalidInput);
  LargestErrorOptions options;
  options.probability = 1;
  EXPECT_THROW(bound(reference(), options), InvalidInput);
}

}  // namespace
}  // namespace symkin
