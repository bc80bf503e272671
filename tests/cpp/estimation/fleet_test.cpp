// SPDX-License-Identifier: MIT
#include "symkin/estimation/fleet.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/mechanisms.hpp"
#include "symkin/estimation/detail/leg_fits.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr Index kRobots = 70;

// Measured at 36 poses, a third of them for each leg.
std::vector<MeasurementSet> robots(const Mechanism& nominal) {
  const RowMatrix poses = sample_workspace(nominal, testing::paper_workspace(), 40, 11).poses;
  std::vector<MeasurementSet> robots;
  for (std::uint64_t seed = 0; seed < kRobots; ++seed) {
    robots.push_back(simulate(disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, seed), nominal,
                              {{-1, poses, 36}}, MeasurementNoise{}, seed)
                         .measurements);
    for (std::size_t row = 0; row < 36; ++row) {
      robots.back().leg_sets[row] = static_cast<Index>(row % 3);
    }
  }
  return robots;
}

std::vector<MeasuredRobot> measured(const Mechanism& nominal,
                                    const std::vector<MeasurementSet>& robots) {
  std::vector<MeasuredRobot> all;
  for (const MeasurementSet& robot : robots) {
    all.push_back(MeasuredRobot::of(nominal, robot));
  }
  return all;
}

void expect_as_alone(const Fleet& fleet, Index robot, const Identification& alone) {
  constexpr double kNear = 1e-6;  // of a deviation, and relative
  const auto at = static_cast<std::size_t>(robot);
  ASSERT_EQ(fleet.failures[at], "");
  const Vector deviations = alone.covariance.diagonal().cwiseSqrt();
  const RowMatrix& parameters = alone.parameters;
  // Not by quotients: what is held has no deviation, and a maximum may or may not pass NaN on.
  const Vector allowed = kNear * deviations;
  const Vector errors =
      fleet.parameters.row(robot).transpose() - Vector::Map(parameters.data(), parameters.size());
  EXPECT_LE((errors.cwiseAbs() - allowed).maxCoeff(), 0);
  const Vector known = fleet.deviations.row(robot).transpose();
  EXPECT_LE(((known - deviations).cwiseAbs() - allowed).maxCoeff(), 0);
  std::size_t rejected = 0;
  for (const LegIdentification& leg : alone.legs) {
    rejected += leg.rejected.size();
  }
  EXPECT_EQ(fleet.rejected[robot], static_cast<double>(rejected));
  for (std::size_t leg = 0; leg < alone.goodness.size(); ++leg) {
    const GoodnessOfFit& fit = alone.goodness[leg];
    const auto column = static_cast<Index>(leg);
    EXPECT_NEAR(fleet.chi_square(robot, column) / fit.chi_square, 1, kNear);
    EXPECT_EQ(fleet.degrees_of_freedom(robot, column), fit.degrees_of_freedom);
  }
}

// A fleet is fitted by the library's own steps, a robot alone by Ceres.
TEST(Fleet, HasARowForEachRobotAsItIsIdentifiedAlone) {
  const Mechanism nominal = testing::paper_3rrr();
  const std::vector<MeasurementSet> made = robots(nominal);
  for (const Estimator estimator : {Estimator::implicit, Estimator::inverse, Estimator::paper}) {
    for (const PoseUse use : {PoseUse::own, PoseUse::all}) {
      IdentificationOptions options;
      options.estimator = estimator;
      options.use = use;
      const Fleet fleet = identify_many(nominal, measured(nominal, made), options, 2);
      const Fleet again = identify_many(nominal, measured(nominal, made), options, 1);
      EXPECT_EQ(fleet.parameters, again.parameters);
      for (const Index robot : {Index{0}, Index{33}, kRobots - 1}) {
        expect_as_alone(fleet, robot,
                        identify(nominal, made[static_cast<std::size_t>(robot)], options));
      }
    }
  }
}

TEST(Fleet, WithALossHasARowForEachRobotAsItIsIdentifiedAlone) {
  const Mechanism nominal = testing::paper_3rrr();
  std::vector<MeasurementSet> made = robots(nominal);
  for (const Index robot : {Index{3}, Index{33}}) {
    made[static_cast<std::size_t>(robot)].poses(7, 0) += 0.003;
  }
  for (const Estimator estimator : {Estimator::implicit, Estimator::inverse}) {
    IdentificationOptions options;
    options.estimator = estimator;
    options.loss = loss_named("cauchy");
    const Fleet fleet = identify_many(nominal, measured(nominal, made), options, 2);
    for (const Index robot : {Index{0}, Index{3}, Index{33}}) {
      const auto i = static_cast<std::size_t>(robot);
      const Identification alone = identify(nominal, made[i], options);
      expect_as_alone(fleet, robot, alone);
      EXPECT_TRUE(robot == 0 || fleet.rejected[robot] > 0);
      EXPECT_EQ(fleet.student_degrees(robot, 1), 36 - 8);
    }
  }
}

// Root of the mean square distance of where `joint` starts from the legs' own fits, in deviations.
double start_from_own_fit(double tolerance) {
  const Mechanism nominal = testing::paper_3rrr();
  const RowMatrix poses = sample_workspace(nominal, testing::paper_workspace(), 40, 11).poses;
  const Mechanism robot = disturb(nominal, {tolerance, tolerance, tolerance}, 2);
  const MeasurementSet measured =
      simulate(robot, nominal, {{-1, poses, 30}}, MeasurementNoise{}, 2).measurements;
  IdentificationOptions options;
  options.use = PoseUse::all;
  const Identification own = identify(nominal, measured, options);
  options.estimator = Estimator::joint;
  const RowMatrix off = joint_start(nominal, measured, options) - own.parameters;
  const Vector deviations = own.covariance.diagonal().cwiseSqrt();
  return std::sqrt(off.reshaped<Eigen::RowMajor>().cwiseQuotient(deviations).cwiseAbs2().mean());
}

TEST(Fleet, StartsAJointFitWhereTheLegsOwnFitsAreWithinTheNoise) {
  const double near = start_from_own_fit(1e-3), far = start_from_own_fit(2e-2);
  // Of a drawing that is nearly right one step of each leg's will do.
  EXPECT_GT(near, 1e-3);
  EXPECT_LT(near, 0.1);
  EXPECT_LT(far, 0.1);
}

WorkspaceOptions bound_workspace() {
  WorkspaceOptions options;
  options.lower = Vector(6);
  options.lower << 0, 0, 1.5, -0.3, -0.3, 0;
  options.upper = Vector(6);
  options.upper << 0, 0, 1.9, 0.3, 0.3, 0;
  options.home = identity_pose(PoseSpace::spatial);
  options.home[2] = 1.7;
  return options;
}

// Robots of other chains, the i-th measured at some poses fewer: three closed by two closures a
// leg among them.
TEST(Fleet, OfOtherChainsAndDifferentCountsHasARowForEachRobotAsItIsIdentifiedAlone) {
  for (const auto& [nominal, workspace] :
       {std::pair{testing::hexapod(), testing::hexapod_workspace()},
        {testing::three_rps(), bound_workspace()}}) {
    const RowMatrix poses = sample_workspace(nominal, workspace, 80, 11).poses;
    for (const double noisier : {1.0, 3.0}) {  // than declared
      for (const char* const loss : {"none", "huber"}) {
        IdentificationOptions options;
        options.noise = {1e-4, 1e-4, 1e-5};
        options.loss = loss_named(loss);
        std::vector<MeasurementSet> robots;
        for (Index robot = 0; robot < 6; ++robot) {
          const auto seed = static_cast<std::uint64_t>(robot);
          robots.push_back(simulate(disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, seed), nominal,
                                    {{-1, poses, 70 - robot}},
                                    {noisier * 1e-4, noisier * 1e-4, noisier * 1e-5}, seed)
                               .measurements);
        }
        const Fleet fleet = identify_many(nominal, measured(nominal, robots), options);
        for (Index robot = 0; robot < 6; ++robot) {
          expect_as_alone(fleet, robot,
                          identify(nominal, robots[static_cast<std::size_t>(robot)], options));
        }
      }
    }
  }
}

TEST(Fleet, IsTheSameWhoeverARobotIsFittedBesideOf) {
  const Mechanism nominal = testing::paper_3rrr();
  std::vector<MeasurementSet> made = robots(nominal);
  made[5].poses(7, 0) += 0.003;  // takes more steps than the others
  const IdentificationOptions options;
  const std::vector<MeasuredRobot> all = measured(nominal, made);
  const Fleet four = identify_many(nominal, {all[3], all[4], all[5], all[6]}, options);
  for (const Index robot : {Index{3}, Index{4}, Index{5}, Index{6}}) {
    const Fleet one = identify_many(nominal, {all[static_cast<std::size_t>(robot)]}, options);
    EXPECT_EQ(four.parameters.row(robot - 3), one.parameters.row(0));
    EXPECT_EQ(four.deviations.row(robot - 3), one.deviations.row(0));
    EXPECT_EQ(four.chi_square.row(robot - 3), one.chi_square.row(0));
  }
}

TEST(Fleet, SaysOfARobotThatFailedWhyAndLeavesTheOthersAlone) {
  const Mechanism nominal = testing::paper_3rrr();
  std::vector<MeasurementSet> made = robots(nominal);
  IdentificationOptions options;
  const Fleet sound = identify_many(nominal, measured(nominal, made), options);
  made[1].readings.col(1).setConstant(0.3);
  made[2].poses(5, 0) = std::numeric_limits<double>::quiet_NaN();
  const Fleet fleet = identify_many(nominal, measured(nominal, made), options);
  EXPECT_NE(fleet.failures[1].find("leg 2 do not show all"), std::string::npos);
  EXPECT_NE(fleet.failures[2].find("not finite"), std::string::npos);
  EXPECT_TRUE(fleet.parameters.middleRows(1, 2).array().isNaN().all());
  EXPECT_EQ(fleet.parameters.row(0), sound.parameters.row(0));
  EXPECT_EQ(fleet.parameters.bottomRows(kRobots - 3), sound.parameters.bottomRows(kRobots - 3));
}

TEST(Fleet, PointsToArraysOfItsShapesAlone) {
  const Mechanism nominal = testing::paper_3rrr();
  const MeasurementSet sound = robots(nominal)[0];
  EXPECT_NO_THROW(MeasuredRobot::of(nominal, sound));
  EXPECT_THROW(
      MeasuredRobot::of(nominal, {sound.poses.leftCols(2), sound.readings, sound.leg_sets}),
      InvalidInput);
  EXPECT_THROW(MeasuredRobot::of(nominal, {sound.poses, sound.readings.topRows(5), sound.leg_sets}),
               InvalidInput);
  EXPECT_THROW(MeasuredRobot::of(nominal, {sound.poses, sound.readings, {}}), InvalidInput);
}

}  // namespace
}  // namespace symkin
