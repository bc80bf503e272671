// SPDX-License-Identifier: MIT
#include "symkin/kinematics/forward_kinematics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "support/mechanisms.hpp"
#include "support/poses.hpp"
#include "symkin/kinematics/continuation.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

TEST(ForwardKinematics, UndoesTheInverseKinematicsFromANeighbouringStart) {
  const Mechanism mechanism = testing::paper_3rrr();
  const WorkspaceSample sample = sample_workspace(mechanism, testing::paper_workspace(), 2000, 3);
  const RowMatrix start = sample.poses.array() + 0.002;
  const auto result = forward_kinematics(mechanism, sample.readings, start);
  EXPECT_EQ(result.converged_count(), 2000);
  EXPECT_LT(testing::worst_difference(mechanism, result.poses, sample.poses), 1e-12);
}

TEST(ForwardKinematics, UndoesTheInverseKinematicsOfAHexapodFromHome) {
  const Mechanism mechanism = testing::hexapod();
  const WorkspaceOptions workspace = testing::hexapod_workspace();
  const WorkspaceSample sample = sample_workspace(mechanism, workspace, 500, 3);
  const auto result = forward_kinematics(mechanism, sample.readings, workspace.home.transpose());
  EXPECT_EQ(result.converged_count(), 500);
  EXPECT_LT(testing::worst_difference(mechanism, result.poses, sample.poses), 1e-11);
}

TEST(ForwardKinematics, SolvesAPointPlatform) {
  const Mechanism mechanism = testing::five_bar();
  const RowMatrix pose = (RowMatrix(1, 2) << 0.05, 0.4).finished();
  const RowMatrix start = (RowMatrix(1, 2) << 0.0, 0.45).finished();
  const auto result = forward_kinematics(mechanism, inverse_kinematics(mechanism, pose), start);
  EXPECT_EQ(result.converged_count(), 1);
  EXPECT_LT((result.poses - pose).norm(), 1e-13);
}

TEST(ForwardKinematics, TakesMoreLegsThanDegreesOfFreedomByLeastSquares) {
  const Mechanism three = testing::paper_3rrr();
  std::vector<Leg> legs = three.legs();
  legs.push_back(legs[0]);
  legs.back().parameters[3] += 0.3;
  legs.back().parameters[5] += 0.3;
  const Mechanism four("4-RRR", *three.chain(), legs);
  const RowMatrix pose = (RowMatrix(1, 3) << 0.05, 0.1, 0.1).finished();
  const RowMatrix start = RowMatrix::Zero(1, 3);
  const auto result = forward_kinematics(four, inverse_kinematics(four, pose), start);
  EXPECT_EQ(result.converged_count(), 1);
  EXPECT_LT((result.poses - pose).norm(), 1e-10);
}

TEST(ForwardKinematics, TakesAsManyLegsAsThereAre) {
  const Mechanism three = testing::paper_3rrr();
  std::vector<Leg> legs;
  for (int i = 0; i < 12; ++i) {
    legs.push_back(three.leg(i % 3));
    legs.back().parameters[3] += 0.02 * i;
    legs.back().parameters[5] += 0.02 * i;
  }
  const Mechanism twelve("12-RRR", *three.chain(), legs);
  const RowMatrix pose = (RowMatrix(1, 3) << 0.05, 0.1, 0.1).finished();
  const RowMatrix start = RowMatrix::Zero(1, 3);
  const auto result = forward_kinematics(twelve, inverse_kinematics(twelve, pose), start);
  EXPECT_EQ(result.converged_count(), 1);
  EXPECT_LT((result.poses - pose).norm(), 1e-12);
}

TEST(ForwardKinematics, SaysTheSameIntoAResultThatIsThere) {
  const Mechanism robot = testing::paper_3rrr();
  auto original = std::make_unique<Mechanism>(robot.with_parameters(robot.parameters()));
  const Mechanism copy = *original;
  original.reset();  // whose legs the copy keeps
  const WorkspaceSample sample = sample_workspace(robot, testing::paper_workspace(), 50, 3);
  const RowMatrix start = sample.poses.array() + 0.002;
  const auto expected = forward_kinematics(robot, sample.readings, start);
  ForwardKinematicsResult result;
  for (const Index count : {50, 7, 50}) {
    forward_kinematics(copy, sample.readings.topRows(count), start.topRows(count), {}, result);
    EXPECT_EQ(result.poses, expected.poses.topRows(count));
    EXPECT_EQ(result.converged_count(), count);
  }
}

TEST(ForwardKinematics, SaysThatReadingsWithoutAPoseDoNotConverge) {
  const Mechanism mechanism = testing::five_bar();
  // Both cranks point outwards, away from each other: the distal links cannot meet.
  RowMatrix readings(1, 2);
  readings << 0 - mechanism.leg(0).parameters[5], M_PI - mechanism.leg(1).parameters[5];
  const RowMatrix start = (RowMatrix(1, 2) << 0.0, 0.45).finished();
  const auto result = forward_kinematics(mechanism, readings, start);
  EXPECT_EQ(result.status[0], ForwardStatus::diverged);
  EXPECT_TRUE(result.poses.array().isNaN().all());
}

TEST(ForwardKinematics, TellsASolutionBeyondASingularityFromOneWithinTheAspect) {
  const Mechanism mechanism = testing::five_bar();
  const RowMatrix pose = (RowMatrix(1, 2) << 0.02, 0.4).finished();
  const RowMatrix readings = inverse_kinematics(mechanism, pose);
  // The other assembly: the point mirrored about the line through the elbows.
  const RowMatrix below = (RowMatrix(1, 2) << 0.02, -0.1).finished();
  const auto result = forward_kinematics(mechanism, readings, pose);
  EXPECT_EQ(result.status[0], ForwardStatus::converged);
  const auto other = forward_kinematics(mechanism, readings, below);
  ASSERT_TRUE(other.poses.allFinite());
  EXPECT_GT((other.poses - pose).norm(), 0.1);
}

TEST(ForwardKinematics, NaNReadingsConcernTheirOwnRowOnly) {
  const Mechanism mechanism = testing::paper_3rrr();
  const WorkspaceSample sample = sample_workspace(mechanism, testing::paper_workspace(), 3, 3);
  RowMatrix readings = sample.readings;
  readings(1, 0) = std::nan("");
  const auto result = forward_kinematics(mechanism, readings, sample.poses);
  EXPECT_EQ(result.status[0], ForwardStatus::converged);
  EXPECT_EQ(result.status[1], ForwardStatus::diverged);
  EXPECT_EQ(result.status[2], ForwardStatus::converged);
}

TEST(ForwardKinematics, RefusesStartsThatFitNoRow) {
  const Mechanism mechanism = testing::paper_3rrr();
  EXPECT_THROW(forward_kinematics(mechanism, RowMatrix::Zero(3, 3), RowMatrix::Zero(2, 3)),
               InvalidInput);
}

TEST(Continued, FindsEveryPoseOfTheWorkspaceWhereStartsFromHomeMissSome) {
  const Mechanism mechanism = testing::paper_3rrr();
  const WorkspaceOptions workspace = testing::paper_workspace();
  const WorkspaceSample sample = sample_workspace(mechanism, workspace, 4000, 1);
  const Vector home = Vector::Zero(3);
  const auto direct = forward_kinematics(mechanism, sample.readings, home.transpose());
  EXPECT_LT(direct.converged_count(), 4000);
  RowMatrix known = direct.poses;
  for (Index i = 0; i < known.rows(); ++i) {
    if (direct.status[static_cast<std::size_t>(i)] != ForwardStatus::converged) {
      known.row(i).setConstant(std::nan(""));
    }
  }
  for (const RowMatrix& poses : {continued(mechanism, sample.readings, home),
                                 continued(mechanism, sample.readings, home, known)}) {
    EXPECT_LT((poses - sample.poses).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Continued, LeavesReadingsThatNoPoseHasAndThoseThatAreMissing) {
  const Mechanism mechanism = testing::paper_3rrr();
  const Vector home = Vector::Zero(3);
  RowMatrix readings(3, 3);
  readings << 0.6, 0.5, 0.5, std::nan(""), 0.5, 0.5, 3, -3, 3;
  const RowMatrix poses = continued(mechanism, readings, home);
  EXPECT_TRUE(poses.row(0).allFinite());
  EXPECT_TRUE(poses.row(1).array().isNaN().all());
  EXPECT_TRUE(poses.row(2).array().isNaN().all());
}

}  // namespace
}  // namespace symkin
