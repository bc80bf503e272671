// SPDX-License-Identifier: MIT
#include "symkin/statistics/fleet_tolerances.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "statistics/promised_numbers.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

struct Fleet {
  RowMatrix information, scores;
};

Fleet reference() {
  const auto& robots = testing::kFleet;
  const auto count = static_cast<Index>(robots.size());
  const auto p = static_cast<Index>(testing::kFleetKinds.size());
  Fleet fleet{RowMatrix(count * p, p), RowMatrix(count, p)};
  for (Index robot = 0; robot < count; ++robot) {
    const auto& given = robots[static_cast<std::size_t>(robot)];
    RowMatrix by_parameters(static_cast<Index>(given.rows.size()), p);
    for (Index i = 0; i < by_parameters.rows(); ++i) {
      const auto& row = given.rows_by_parameters[static_cast<std::size_t>(i)];
      by_parameters.row(i) = Eigen::Map<const Vector>(row.data(), p).transpose();
    }
    const Eigen::Map<const Vector> rows(given.rows.data(), by_parameters.rows());
    fleet.information.middleRows(robot * p, p) = by_parameters.transpose() * by_parameters;
    fleet.scores.row(robot) = (by_parameters.transpose() * rows).transpose();
  }
  return fleet;
}

TEST(FleetTolerances, AreThoseOfTheReference) {
  const Fleet fleet = reference();
  const FleetTolerances found =
      fleet_tolerances(fleet.information, fleet.scores, testing::kFleetKinds);
  EXPECT_TRUE(found.converged);
  EXPECT_LT(found.iterations, 60);
  for (std::size_t kind = 0; kind < testing::kFleetFactors.size(); ++kind) {
    const auto i = static_cast<Index>(kind);
    EXPECT_NEAR(found.factors[i] / testing::kFleetFactors[kind], 1, 1e-6);
    EXPECT_NEAR(found.log_deviations[i] / testing::kFleetLogDeviations[kind], 1, 1e-5);
  }
}

TEST(FleetTolerances, SayOfAKindThatNothingShowsThatItIsUnknown) {
  Fleet fleet = reference();
  const Index p = fleet.scores.cols();
  for (Index row = 0; row < fleet.information.rows(); ++row) {
    fleet.information.row(row)[1] = fleet.information.row(row)[4] = 0;
    if (row % p == 1 || row % p == 4) {
      fleet.information.row(row).setZero();
    }
  }
  fleet.scores.col(1).setZero();
  fleet.scores.col(4).setZero();
  const FleetTolerances found =
      fleet_tolerances(fleet.information, fleet.scores, testing::kFleetKinds);
  EXPECT_TRUE(std::isinf(found.log_deviations[1]));
  EXPECT_LT(found.log_deviations[0], 0.7);
}

TEST(FleetTolerances, EndNearZeroForRobotsComputedFromTheDrawing) {
  const Fleet fleet = reference();
  const FleetTolerances found =
      fleet_tolerances(fleet.information, RowMatrix::Zero(fleet.scores.rows(), fleet.scores.cols()),
                       testing::kFleetKinds);
  EXPECT_LT(found.factors.maxCoeff(), 1e-3);
}

TEST(FleetTolerances, RefuseArraysThatDoNotFit) {
  const Fleet fleet = reference();
  EXPECT_THROW(fleet_tolerances(fleet.information, fleet.scores, {0, 1}), InvalidInput);
  EXPECT_THROW(fleet_tolerances(fleet.information, fleet.scores, {0, 1, 2, 0, 1, -1}),
               InvalidInput);
  EXPECT_THROW(fleet_tolerances(RowMatrix::Zero(6, 6), fleet.scores, testing::kFleetKinds),
               InvalidInput);
}

}  // namespace
}  // namespace symkin
