// SPDX-License-Identifier: MIT
#include "symkin/estimation/evaluation.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/estimation/accuracy.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

TEST(Evaluation, RefusesReadingsThatAreNotOneAPose) {
  const Mechanism mechanism = testing::paper_3rrr();
  EXPECT_THROW(measurement_errors(mechanism, RowMatrix::Zero(1, 3), RowMatrix::Zero(0, 3)),
               InvalidInput);
  EXPECT_THROW(measurement_errors(mechanism, RowMatrix::Zero(1, 3), RowMatrix::Zero(2, 3)),
               InvalidInput);
  EXPECT_THROW(accuracy_weights(mechanism, RowMatrix::Zero(0, 3)), InvalidInput);
}

TEST(Evaluation, IsZeroForThePerfectModel) {
  const Mechanism mechanism = testing::paper_3rrr();
  const RowMatrix poses = sample_workspace(mechanism, testing::paper_workspace(), 100, 2).poses;
  const PoseErrors errors = command_errors(mechanism, mechanism, poses);
  EXPECT_EQ(errors.evaluated, 100);
  EXPECT_LT(errors.position_max, 1e-13);
  EXPECT_LT(errors.orientation_max, 1e-13);
}

TEST(Evaluation, CountsPosesThatTheModelCannotCommand) {
  const Mechanism mechanism = testing::paper_3rrr();
  const RowMatrix poses = (RowMatrix(2, 3) << 0, 0, 0, 4, 0, 0).finished();
  const PoseErrors errors = command_errors(mechanism, mechanism, poses);
  EXPECT_EQ(errors.evaluated, 1);
  EXPECT_EQ(errors.failed, 1);
  EXPECT_TRUE(std::isnan(errors.differences(1, 0)));
}

TEST(Accuracy, FirstOrderPredictionEqualsTheErrorOfSmallDisturbances) {
  const std::pair<Mechanism, WorkspaceOptions> examples[] = {
      {testing::paper_3rrr(), testing::paper_workspace()},
      {testing::hexapod(), testing::hexapod_workspace()}};
  for (const auto& [nominal, workspace] : examples) {
    const RowMatrix poses = sample_workspace(nominal, workspace, 200, 2).poses;
    const AccuracyWeights weights = accuracy_weights(nominal, poses);
    const Mechanism actual = disturb(nominal, {1e-6, 1e-6, 1e-6}, 8);
    const RowMatrix change = actual.parameters() - nominal.parameters();
    const Eigen::Map<const Vector> error(change.data(), change.size());
    // The "covariance" of one known error is its outer product.
    const ExpectedAccuracy expected = expected_accuracy(weights, error * error.transpose());
    const PoseErrors errors = command_errors(actual, nominal, poses);
    EXPECT_NEAR(expected.position / errors.position_rms, 1, 1e-3) << nominal.name();
    EXPECT_NEAR(expected.orientation / errors.orientation_rms, 1, 1e-3) << nominal.name();
  }
}

TEST(Accuracy, PosesOutOfReachOrSingularAreLeftOutAndCounted) {
  const Mechanism mechanism = testing::paper_3rrr();
  const RowMatrix good = sample_workspace(mechanism, testing::paper_workspace(), 5, 2).poses;
  // Between two good poses one beyond the reach of all legs.
  RowMatrix poses(3, 3);
  poses << good.row(0), RowMatrix::Constant(1, 3, 40), good.row(1);
  const AccuracyWeights some = accuracy_weights(mechanism, poses);
  EXPECT_EQ(some.evaluated, 2);
  EXPECT_EQ(some.failed, 1);
  const AccuracyWeights all = accuracy_weights(mechanism, good.topRows(2));
  EXPECT_TRUE(some.position.isApprox(all.position));
  EXPECT_TRUE(some.orientation.isApprox(all.orientation));
  EXPECT_THROW(accuracy_weights(mechanism, poses.middleRows(1, 1)), InvalidInput);
}

TEST(Accuracy, ParallelLegsAreSingular) {
  // Three equal legs side by side cannot hold the platform's angle, nor its way across.
  const Mechanism one = testing::paper_3rrr();
  RowMatrix alike = one.parameters();
  alike.row(1) = alike.row(0);
  alike.row(2) = alike.row(0);
  const Mechanism mechanism = one.with_parameters(alike);
  const RowMatrix home = RowMatrix::Zero(1, 3);
  EXPECT_THROW(accuracy_weights(mechanism, home), InvalidInput);
}

TEST(Evaluation, MeasuredPosesAreComparedWithTheModelsForwardKinematics) {
  const Mechanism mechanism = testing::hexapod();
  const RowMatrix poses = sample_workspace(mechanism, testing::hexapod_workspace(), 50, 2).poses;
  RowMatrix measured = poses;
  Vector step = Vector::Zero(6);
  step[0] = 0.001;
  for (Index i = 0; i < 50; ++i) {
    move_pose(PoseSpace::spatial, step.data(), measured.row(i).data());
  }
  const PoseErrors errors =
      measurement_errors(mechanism, measured, inverse_kinematics(mechanism, poses));
  EXPECT_NEAR(errors.position_rms, 0.001, 1e-10);
  EXPECT_NEAR(errors.orientation_rms, 0, 1e-10);
}

}  // namespace
}  // namespace symkin
