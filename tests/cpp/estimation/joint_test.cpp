// SPDX-License-Identifier: MIT
#include "symkin/estimation/joint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "support/mechanisms.hpp"
#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/random.hpp"

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
                        std::vector<bool>(20, false));
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

// A hexapod whose poses a device measured that stands elsewhere, the target somewhere on the
// platform, both known.
struct Elsewhere {
  Mechanism nominal = testing::hexapod();
  symkin::Setup setup = symkin::Setup::of(nominal);
  Observations observations;
  JointOptions options;

  explicit Elsewhere(const Eigen::Vector3d& target) {
    constexpr Index kCount = 40;
    const PoseSpace space = PoseSpace::spatial;
    setup.base = {{1, -2, 0.5}, rotation_of({0.3, -0.8, 1.1})};
    setup.target = {target, rotation_of({-0.2, 0.5, 0.1})};
    const Mechanism actual = disturb(nominal, {1e-3, 1e-3, 1e-3}, 7);
    options.start = sample_workspace(nominal, testing::hexapod_workspace(), kCount, 3).poses;
    observations.readings = everywhere(inverse_kinematics(actual, options.start), 5e-5, 6);
    observations.readings.values(4, 1) = std::numeric_limits<double>::quiet_NaN();
    observations.poses = everywhere(options.start, 1e-4, 6);
    observations.poses.deviations.rightCols(3).setConstant(3e-4);
    for (Index i = 0; i < kCount; ++i) {
      Eigen::Matrix<double, 6, 1> error;
      for (Index k = 0; k < 6; ++k) {
        error[k] = 1e-4 * std::sin(static_cast<double>(7 * i + 3 * k));
      }
      const Frame frame = setup.base * frame_of_pose(space, options.start.row(i).data());
      pose_of_frame(space, moved(frame * setup.target, error), &observations.poses.values(i, 0));
    }
  }

  JointFit fit() const {
    return fit_jointly(nominal, setup, observations, Layout::of_all_parameters(nominal, setup),
                       options);
  }
};

TEST(LatentPoses, MeasuredInFullGiveTheFitOfTheGeneralElimination) {
  for (const Eigen::Vector3d& target : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.1, 0.2, 0)}) {
    Elsewhere robot(target);
    const JointFit fit = robot.fit();
    ASSERT_TRUE(fit.converged) << fit.failure;
    // A column without a value leaves nothing but the general elimination.
    robot.observations.reported =
        everywhere(RowMatrix::Constant(40, 7, std::numeric_limits<double>::quiet_NaN()), 1, 6);
    const JointFit general = robot.fit();
    const Vector deviations = general.covariance.diagonal().cwiseSqrt();
    EXPECT_LT((fit.change - general.change).cwiseQuotient(deviations).norm(), 1e-6);
    EXPECT_LT((fit.covariance - general.covariance).norm(), 1e-6 * general.covariance.norm());
    EXPECT_NEAR(fit.chi_square_data, general.chi_square_data, 1e-8 * general.chi_square_data);
    ASSERT_EQ(fit.rows.size(), 40 * 12 - 1);
    ASSERT_EQ(fit.rows.size(), general.rows.size());
    for (std::size_t k = 0; k < fit.rows.size(); ++k) {
      const RowFit& row = fit.rows[k];
      const RowFit& other = general.rows[k];
      ASSERT_EQ(row.pose, other.pose);
      ASSERT_EQ(row.kind, other.kind);
      ASSERT_EQ(row.index, other.index);
      EXPECT_NEAR(row.residual, other.residual, 1e-9);
      EXPECT_NEAR(row.t, other.t, 1e-5);
      EXPECT_NEAR(row.blunder, other.blunder, 1e-8);
    }
  }
}

// The estimate hardly follows a pose that a loss rejects: what a reading there is off by is known
// as well as the others tell it, whose estimate is worse where they are few.
TEST(JointFit, WithALossSaysByHowMuchAReadingIsOffAndHowWellThatIsKnown) {
  constexpr Index kCount = 24;
  constexpr double kOff = 5e-3;  // 100 deviations
  const Mechanism nominal = testing::paper_3rrr();
  const Mechanism actual = disturb(nominal, {1e-3, 1e-3, 1e-3}, 7);
  const RowMatrix poses = sample_workspace(nominal, testing::paper_workspace(), kCount, 3).poses;
  const RowMatrix readings = inverse_kinematics(actual, poses);
  const symkin::Setup setup = symkin::Setup::of(nominal);
  const Layout layout = Layout::of_all_parameters(nominal, setup);
  JointOptions options;
  options.start = poses;
  options.loss = loss_named("cauchy");
  Random random(5);
  double squares = 0;
  constexpr int kTurns = 6;
  for (Index i = 0; i < kTurns * kCount; ++i) {
    const Index pose = i % kCount;
    const auto noise = [&](double /*unused*/) { return random.normal(); };
    Observations observations;
    observations.readings = everywhere(readings + 5e-5 * readings.unaryExpr(noise), 5e-5, 3);
    observations.poses = everywhere(poses + 1e-4 * poses.unaryExpr(noise), 1e-4, 3);
    observations.readings.values(pose, 1) += kOff;
    const JointFit fit = fit_jointly(nominal, setup, observations, layout, options);
    ASSERT_TRUE(fit.converged) << fit.failure;
    ASSERT_LT(fit.loss_weights[pose], 0.05);
    const auto row = std::find_if(fit.rows.begin(), fit.rows.end(), [&](const RowFit& each) {
      return each.pose == pose && each.kind == 0 && each.index == 1;
    });
    ASSERT_NE(row, fit.rows.end());
    EXPECT_NEAR(row->blunder / kOff, 1, 0.25) << i;
    const double off = (row->blunder - kOff) * row->t / row->blunder;
    squares += off * off;
  }
  // Four standard errors of 144 squares.
  EXPECT_NEAR(squares / (kTurns * kCount), 1, 0.47);
}

TEST(LatentPoses, AreRefusedWhereExactObservationsContradictEachOther) {
  const Mechanism three = testing::paper_3rrr();
  std::vector<Leg> legs = three.legs();
  legs.push_back(legs.front());
  legs.back().parameters[3] += 0.3;
  const Mechanism four("four legs", *three.chain(), legs);
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

TEST(JointFit, IsNotRefusedForWhatItsStartAloneHides) {
  // The angle of an offset that has no length in the drawing.
  const Mechanism drawn = testing::paper_3rrr();
  std::vector<Leg> legs = drawn.legs();
  legs[1].parameters.head<2>().setConstant(2);  // long enough without it
  legs[1].parameters[4] = 0;
  const Mechanism nominal("short", *drawn.chain(), legs);
  const RowMatrix poses = sample_workspace(drawn, testing::paper_workspace(), 30, 3).poses;
  legs[1].parameters[4] = 2e-3;
  const Mechanism actual("short", *drawn.chain(), legs);
  Observations observations;
  observations.readings = everywhere(inverse_kinematics(actual, poses), 5e-5, 3);
  observations.poses = everywhere(poses, 1e-4, 3);
  JointOptions options;
  options.start = poses;
  const symkin::Setup setup = symkin::Setup::of(nominal);
  const JointFit fit =
      fit_jointly(nominal, setup, observations, Layout::of_all_parameters(nominal, setup), options);
  EXPECT_TRUE(fit.converged) << fit.failure;
  EXPECT_EQ(fit.rank, 24);
  EXPECT_NEAR(fit.setup.parameters(1, 4), 2e-3, 1e-9);
}

TEST(JointFit, SetsAPoseAsideAtWhichNothingWasObservedWhereverItStarts) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Mechanism nominal = testing::paper_3rrr();
  Observations observations = full_poses(nominal, 30);
  JointOptions options;
  options.start = observations.poses.values;
  options.tolerances = Vector::Constant(24, 1e-3);
  observations.readings.values.row(4).setConstant(kNone);
  observations.poses.values.row(4).setConstant(kNone);
  const symkin::Setup setup = symkin::Setup::of(nominal);
  const Layout layout = Layout::of_all_parameters(nominal, setup);
  const JointFit started = fit_jointly(nominal, setup, observations, layout, options);
  options.start.row(4).setConstant(kNone);
  const JointFit without = fit_jointly(nominal, setup, observations, layout, options);
  EXPECT_EQ(started.aside, std::vector<Index>{4});
  EXPECT_EQ(started.aside, without.aside);
  EXPECT_TRUE(started.poses.row(4).array().isNaN().all());
  EXPECT_EQ(started.change, without.change);
  EXPECT_EQ(started.goodness.degrees_of_freedom, without.goodness.degrees_of_freedom);
}

TEST(LatentPoses, OfWhichNothingIsKnownAreEliminatedWithoutACondition) {
  const PoseElimination nothing = eliminate_pose(Eigen::MatrixXd(0, 3), Vector(0), 0);
  EXPECT_EQ(nothing.conditions.cols(), 0);
  EXPECT_EQ(nothing.solution.rows(), 3);
  EXPECT_EQ(nothing.solution.cols(), 0);
}

TEST(LatentPoses, ASingularPoseIsAFailedFitAndTooManyExactReadingsAreInvalid) {
  RowMatrix by_pose(4, 2);
  by_pose << 1, 2, 1, 2, 1, 0, 0, 1;
  Vector variances(4);
  variances << 0, 0, 1, 1;
  EXPECT_THROW(eliminate_pose(by_pose, variances, 0), FailedFit);
  by_pose.row(1) << 2, 1;
  EXPECT_EQ(eliminate_pose(by_pose, variances, 0).conditions.cols(), 2);
  variances[2] = 0;
  try {
    eliminate_pose(by_pose, variances, 4);
    FAIL();
  } catch (const FailedFit&) {
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_EQ(std::string(error.what()),
              "pose 5 has more exact readings than degrees of freedom; declare a noise of the "
              "readings above zero");
  }
}

// The second leg's second parameter follows the first leg's, once shared and once tied.
TEST(Layout, TiesOfFactorOneDoWhatASharedColumnDoes) {
  const Mechanism nominal = testing::paper_3rrr();
  const Observations observations = full_poses(nominal, 20);
  const symkin::Setup setup = symkin::Setup::of(nominal);
  const UnknownList list(setup);
  Layout shared = Layout::of_all_parameters(nominal, setup);
  const auto first = static_cast<std::size_t>(list.leg(0) + 1);
  const auto second = static_cast<std::size_t>(list.leg(1) + 1);
  const Index left_out = shared.column[second];
  for (Index& column : shared.column) {
    column -= column > left_out ? 1 : 0;
  }
  shared.prior.conservativeResize(shared.columns() - 1);
  Layout tied = shared;
  shared.column[second] = shared.column[first];
  tied.column[second] = -1;
  tied.ties = {{static_cast<Index>(second), tied.column[first], 1}};
  JointOptions options;
  options.start = observations.poses.values;
  const JointFit one = fit_jointly(nominal, setup, observations, shared, options);
  const JointFit other = fit_jointly(nominal, setup, observations, tied, options);
  ASSERT_TRUE(one.converged && other.converged) << one.failure << other.failure;
  const Vector deviations = one.covariance.diagonal().cwiseSqrt();
  EXPECT_LT((one.change - other.change).cwiseQuotient(deviations).norm(), 1e-6);
  EXPECT_LT((one.covariance - other.covariance).norm(), 1e-6 * one.covariance.norm());

  tied.ties[0].factor = -2;  // moves the other way, twice as far
  const JointFit twice = fit_jointly(nominal, setup, observations, tied, options);
  ASSERT_TRUE(twice.converged) << twice.failure;
  const RowMatrix moved = twice.setup.parameters - setup.parameters;
  EXPECT_NEAR(moved(1, 1), -2 * moved(0, 1), 1e-15);
  tied.ties[0].column = tied.columns();
  EXPECT_THROW(fit_jointly(nominal, setup, observations, tied, options), InvalidInput);
}

TEST(Layout, RefusesPriorsOfOtherColumns) {
  const Mechanism nominal = testing::paper_3rrr();
  const symkin::Setup setup = symkin::Setup::of(nominal);
  Layout layout = Layout::of_all_parameters(nominal, setup);
  for (const Index columns : {Index{0}, layout.columns() - 1, layout.columns() + 1}) {
    layout.relations = RowMatrix::Ones(1, columns);
    EXPECT_THROW(layout.check(nominal, setup), InvalidInput) << columns;
  }
  layout.relations = RowMatrix::Ones(1, layout.columns());
  EXPECT_NO_THROW(layout.check(nominal, setup));
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
