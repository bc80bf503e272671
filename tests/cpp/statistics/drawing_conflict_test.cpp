// SPDX-License-Identifier: MIT
#include "symkin/statistics/drawing_conflict.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "statistics/promised_numbers.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

RowMatrix matrix_of(const std::vector<testing::Numbers>& rows) {
  RowMatrix matrix(static_cast<Index>(rows.size()), static_cast<Index>(rows.front().size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    matrix.row(static_cast<Index>(i)) =
        Eigen::Map<const Vector>(rows[i].data(), matrix.cols()).transpose();
  }
  return matrix;
}

Vector vector_of(const testing::Numbers& numbers) {
  return Eigen::Map<const Vector>(numbers.data(), static_cast<Index>(numbers.size()));
}

// The covariance of the parameters, and the estimate, from rows, tolerances and what is free.
struct Fit {
  Vector estimate;
  RowMatrix covariance;
  explicit Fit(const testing::ConflictCase& given) {
    const RowMatrix by_parameters = matrix_of(given.rows_by_parameters);
    const RowMatrix by_free = matrix_of(given.rows_by_free);
    RowMatrix all(by_parameters.rows(), by_parameters.cols() + by_free.cols());
    all << by_parameters, by_free;
    RowMatrix information = all.transpose() * all;
    const Index p = by_parameters.cols();
    information.diagonal().head(p) += vector_of(given.tolerances).array().pow(-2).matrix();
    const RowMatrix inverse = information.inverse();
    covariance = inverse.topLeftCorner(p, p);
    estimate = (inverse * (all.transpose() * vector_of(given.rows))).head(p);
  }
};

TEST(DrawingConflict, HasTheNumbersOfTheReference) {
  for (const auto& given : testing::kConflicts) {
    const Fit fit(given);
    EXPECT_LT((fit.estimate - vector_of(given.estimate)).cwiseAbs().maxCoeff(), 1e-9) << given.name;
    const DrawingConflict found =
        drawing_conflict(fit.estimate, fit.covariance, vector_of(given.tolerances));
    EXPECT_EQ(found.directions, given.directions) << given.name;
    EXPECT_NEAR(found.q / given.q, 1, 1e-6) << given.name;
    EXPECT_NEAR(found.ratio, found.q / static_cast<double>(given.directions), 1e-12);
    EXPECT_NEAR(found.p_large / given.p_large, 1, 1e-5) << given.name;
    EXPECT_NEAR(found.weighted / given.weighted, 1, 1e-6) << given.name;
    EXPECT_NEAR(found.p_small, 1 - given.weighted_p_large, 1e-8) << given.name;
    EXPECT_NEAR(found.factor / given.factor, 1, 1e-5) << given.name;
  }
}

// One direction of variance 0.2 by noise alone and 1 with the tolerances, u^2 of the robot.
TEST(DrawingConflict, SaysHowMuchLikelierItsFactorIsThanNone) {
  const auto found = [](double square) {
    const Vector change = Vector::Constant(1, std::sqrt(0.8 * square));
    return drawing_conflict(change, RowMatrix::Constant(1, 1, 0.2), Vector::Ones(1));
  };
  for (const double square : {0.5, 0.9, 4.0}) {
    EXPECT_NEAR(found(square).as_drawn, std::log(0.2) + square / 0.2 - std::log(square) - 1, 1e-6);
  }
  EXPECT_NEAR(found(0.1).as_drawn, 0, 1e-9);  // less than noise alone makes
}

TEST(DrawingConflict, IsNoneWhereTheDataShowNothing) {
  const Vector tolerances = Vector::Constant(2, 0.1);
  const RowMatrix covariance = 0.01 * RowMatrix::Identity(2, 2);
  const DrawingConflict found = drawing_conflict(Vector::Zero(2), covariance, tolerances);
  EXPECT_EQ(found.directions, 0);
  EXPECT_EQ(found.p_large, 1);
  EXPECT_EQ(found.p_small, 1);
  EXPECT_EQ(found.ratio, 1);
}

TEST(DrawingConflict, RefusesDeviationsThatAreNone) {
  EXPECT_THROW(drawing_conflict(Vector::Zero(2), RowMatrix::Zero(2, 2), Vector::Zero(2)),
               InvalidInput);
  EXPECT_THROW(drawing_conflict(Vector::Zero(2), RowMatrix::Zero(3, 3), Vector::Ones(2)),
               InvalidInput);
}

}  // namespace
}  // namespace symkin
