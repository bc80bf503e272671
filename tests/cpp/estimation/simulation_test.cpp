// SPDX-License-Identifier: MIT
#include "symkin/estimation/simulation.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

const MeasurementNoise kNoise{1e-4, 2e-4, 5e-5};

PoseSet some_poses(const Mechanism& mechanism, Index wanted, Index spares) {
  return {0, sample_workspace(mechanism, testing::paper_workspace(), wanted + spares, 2).poses,
          wanted};
}

TEST(Simulation, MeasuresThePosesOfTheActualMechanismWithTheDeclaredNoise) {
  const Mechanism nominal = testing::paper_3rrr();
  const Mechanism actual = disturb(nominal, {}, 4);
  const PoseSet set = some_poses(nominal, 2000, 20);
  const MeasurementSet measured = simulate(actual, nominal, {set}, kNoise, 4).measurements;
  ASSERT_EQ(measured.poses.rows(), 2000);
  // The closures of the actual mechanism at what was measured are noise of the variance v.
  Vector z(2000);
  const ClosureRows rows = linearise(actual, 0, measured.poses, measured.readings.col(0));
  z = rows.closure.cwiseQuotient(closure_variances(rows, PoseSpace::planar, kNoise).cwiseSqrt());
  EXPECT_NEAR(z.mean(), 0, 0.1);
  EXPECT_NEAR(z.squaredNorm() / 2000, 1, 0.15);
}

TEST(Simulation, ReplacesWhatTheActualMechanismCannotTakeAndCountsIt) {
  const Mechanism nominal = testing::paper_3rrr();
  PoseSet set = some_poses(nominal, 30, 5);
  set.poses.row(7) << 0.9, 0.8, 0;  // beyond every leg's reach
  const Simulation simulation = simulate(nominal, nominal, {set}, kNoise, 1);
  EXPECT_EQ(simulation.replaced, std::vector<Index>{1});
  EXPECT_EQ(simulation.measurements.poses.rows(), 30);
  EXPECT_TRUE(simulation.measurements.poses.allFinite());
}

TEST(Simulation, ReplacesAPairOfWhichOnePoseCannotBeTaken) {
  const Mechanism nominal = testing::paper_3rrr();
  PoseSet set = some_poses(nominal, 6, 4);
  set.together = 2;
  const Simulation whole = simulate(nominal, nominal, {set}, kNoise, 1);
  set.poses.row(3) << 0.9, 0.8, 0;  // beyond every leg's reach
  set.poses.row(6) = set.poses.row(3);
  const Simulation simulation = simulate(nominal, nominal, {set}, kNoise, 1);
  EXPECT_EQ(simulation.replaced, std::vector<Index>{2});
  const auto poses = [](const Simulation& of, Index row) {
    return of.measurements.readings.row(row);
  };
  EXPECT_NEAR((poses(simulation, 0) - poses(whole, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((poses(simulation, 2) - poses(whole, 4)).norm(), 0, 1e-2);  // noise of their own
  set.wanted = 5;
  EXPECT_THROW(simulate(nominal, nominal, {set}, kNoise, 1), InvalidInput);
}

TEST(Simulation, SaysThatASetHasTooFewSpares) {
  const Mechanism nominal = testing::paper_3rrr();
  PoseSet set = some_poses(nominal, 30, 0);
  set.poses.row(7) << 0.9, 0.8, 0;
  EXPECT_THROW(simulate(nominal, nominal, {set}, kNoise, 1), InvalidInput);
}

TEST(Simulation, RefusesASetForALegThatDoesNotExistOrWithMorePosesThanItHas) {
  const Mechanism nominal = testing::paper_3rrr();
  for (const auto& [leg, wanted] : {std::pair{3, 5}, {-2, 5}, {0, -1}, {0, 6}}) {
    PoseSet set = some_poses(nominal, 5, 0);
    set.leg = leg;
    set.wanted = wanted;
    EXPECT_THROW(simulate(nominal, nominal, {set}, kNoise, 1), InvalidInput) << leg << wanted;
  }
}

TEST(Simulation, TheSameSeedGivesTheSameRobotAndTheSameNoise) {
  const Mechanism nominal = testing::paper_3rrr();
  EXPECT_EQ(disturb(nominal, {}, 4).parameters(), disturb(nominal, {}, 4).parameters());
  EXPECT_NE(disturb(nominal, {}, 4).parameters(), disturb(nominal, {}, 5).parameters());
  const PoseSet set = some_poses(nominal, 10, 2);
  EXPECT_EQ(simulate(nominal, nominal, {set}, kNoise, 4).measurements.poses,
            simulate(nominal, nominal, {set}, kNoise, 4).measurements.poses);
}

}  // namespace
}  // namespace symkin
