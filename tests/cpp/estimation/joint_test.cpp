// SPDX-License-Identifier: MIT
#include "symkin/estimation/joint.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/mechanisms.hpp"
#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"

namespace symkin {
namespace {

Observed everywhere(const RowMatrix& values, double deviation, Index columns) {
  return {values, RowMatrix::Constant(values.rows(), columns, deviation)};
}

// Full poses of a robot with errors, each reading and coordinate off a little.
Observations full_poses(const Mechanism& nominal, Index count) {
  const RowMatrix poses = sample_workspace(nominal, testing::paper_workspace(), count, 3).poses;
  const Mechanism actual = disturb(nominal, {1e-3, 1e-3, 1e-3}, 7);
  Observations observations;
  observations.readings = everywhere(inverse_kinematics(actual, poses), 5e-5, 3);
  RowMatrix measured = poses;
  for (Index i = 0; i < measured.size(); ++i) {
    measured.data()[i] += 1e-4 * std::sin(static_cast<double>(7 * i));
  }
  observations.poses = everywhere(measured, 1e-4, 3);
  return observations;
}

TEST(LatentPoses, MeasuredInFullBringTheConditionsOfTheGeneralElimination) {
  const Mechanism nominal = testing::paper_3rrr();
  Observations observations = full_poses(nominal, 20);
  observations.readings.values(4, 1) = std::numeric_limits<double>::quiet_NaN();
  const symkin::Setup setup = symkin::Setup::of(nominal);
  const Layout layout = Layout::of_all_parameters(nominal, setup);
  LatentProblem problem(nominal, observations, layout, setup, observations.poses.values,
                        std::vector<bool>(20, false), RobustLoss(), 1);
  NormalEquations equations;
  for (int step = 0; step < 2; ++step) {  // at the measured poses, and away from them
    ASSERT_TRUE(problem.linearise(equations));
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(24, 24);
    Vector gradient = Vector::Zero(24);
    double cost = 0;
    for (Index i = 0; i < 20; ++i) {
      const LinearPose general = problem.linear(i);
      ASSERT_EQ(general.count(), i == 4 ? 2 : 3);
      information += general.jacobian.transpose() * general.jacobian;
      gradient += general.jacobian.transpose() * general.conditions;
      cost += general.conditions.squaredNorm();
    }
    EXPECT_NEAR(cost, equations.cost, 1e-9 * cost);
    EXPECT_LT((information - equations.information).norm(), 1e-9 * information.norm());
    EXPECT_LT((gradient - equations.gradient).norm(), 1e-9 * gradient.norm());
    problem.step(Vector::Constant(24, 1e-4));
  }
}

TEST(LatentPoses, AreRefusedWhereExactObservationsContradictEachOther) {
  const Mechanism three = testing::paper_3rrr();
  std::vector<Leg> legs = three.legs();
  legs.push_back(legs.front());
  legs.back().parameters[3] += 0.3;
  const Mechanism four("four legs", three.model(), legs);
  const RowMatrix poses = sample_workspace(three, testing::paper_workspace(), 12, 3).poses;
  Observations observations;
  observations.readings = everywhere(inverse_kinematics(four, poses), 0, 4);
  JointOptions options;
  options.start = poses;
  const symkin::Setup setup = symkin::Setup::of(four);
  Layout layout = Layout::of_all_parameters(four, setup);
  layout.prior.setConstant(1e-3);
  EXPECT_THROW(fit_jointly(four, setup, observations, layout, options), InvalidInput);
  observations.readings.deviations.setConstant(1e-5);
  EXPECT_TRUE(fit_jointly(four, setup, observations, layout, options).converged);
}

TEST(JointFit, NamesDirectionsThatNothingShowsAndHoldsThemOnRequest) {
  const Mechanism nominal = testing::paper_3rrr();
  Observations observations = full_poses(nominal, 30);
  observations.poses.values.col(2).setConstant(std::numeric_limits<double>::quiet_NaN());
  JointOptions options;
  options.start = observations.poses.values;
  options.start.col(2).setZero();
  const RowMatrix exact = sample_workspace(nominal, testing::paper_workspace(), 30, 3).poses;
  options.start.col(2) = exact.col(2);
  options.tolerances = Vector::Constant(24, 1e-3);
  const symkin::Setup setup = symkin::Setup::of(nominal);
  const Layout layout = Layout::of_all_parameters(nominal, setup);
  // A turn of the platform's own frame cannot be seen from positions.
  try {
    fit_jointly(nominal, setup, observations, layout, options);
    FAIL() << "expected NotIdentifiable";
  } catch (const NotIdentifiable& error) {
    ASSERT_EQ(error.null_directions.cols(), 1);
    for (Index leg = 0; leg < 3; ++leg) {
      EXPECT_NEAR(std::abs(error.null_directions(8 * leg + 5, 0)), std::sqrt(1.0 / 3), 1e-5);
    }
  }
  options.gauge = Gauge::nominal;
  const JointFit fit = fit_jointly(nominal, setup, observations, layout, options);
  EXPECT_TRUE(fit.converged) << fit.failure;
  EXPECT_EQ(fit.data_rank, 23);
  EXPECT_EQ(fit.gauge_directions, 1);
  EXPECT_NEAR(fit.change[5] + fit.change[13] + fit.change[21], 0, 1e-9);
}

TEST(Layout, RefusesScalarsThatTheMechanismDoesNotHave) {
  const Mechanism nominal = testing::paper_3rrr();
  const symkin::Setup setup = symkin::Setup::of(nominal);
  Layout layout = Layout::of_all_parameters(nominal, setup);
  layout.column[static_cast<std::size_t>(UnknownList(setup).base() + 2)] = 0;  // z
  EXPECT_THROW(layout.check(nominal, setup), InvalidInput);
}

}  // namespace
}  // namespace symkin
