// SPDX-License-Identifier: MIT
#include "symkin/kinematics/constraint.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "support/mechanisms.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

class Bound : public ::testing::TestWithParam<bool> {
 protected:
  Mechanism nominal() const { return GetParam() ? testing::three_prs() : testing::three_rps(); }

  // With errors, so that x, y and the turn about Z are not zero anywhere.
  Mechanism mechanism() const {
    Random random(3);
    RowMatrix parameters = nominal().parameters();
    for (Index i = 0; i < parameters.size(); ++i) {
      parameters.data()[i] += 0.01 * random.normal();
    }
    return nominal().with_parameters(parameters);
  }

  RowMatrix drawn(Index count) const {
    Random random(4);
    const Vector origin = identity_pose(PoseSpace::spatial);
    RowMatrix poses(count, 7);
    for (Index i = 0; i < count; ++i) {
      Vector step(6);
      step << 0, 0, (GetParam() ? 0.6 : 1.5) + 0.4 * random.uniform(),
          0.7 * random.uniform() - 0.35, 0.7 * random.uniform() - 0.35, 0;
      poses.row(i) = origin.transpose();
      move_pose(PoseSpace::spatial, step.data(), poses.row(i).data());
    }
    return poses;
  }

  static RowMatrix coordinates(const RowMatrix& poses) {
    const Vector origin = identity_pose(PoseSpace::spatial);
    RowMatrix all(poses.rows(), 6);
    for (Index i = 0; i < poses.rows(); ++i) {
      pose_difference(PoseSpace::spatial, poses.row(i).data(), origin.data(), all.row(i).data());
    }
    return all;
  }
};

TEST_P(Bound, LeavesThreeDegreesOfFreedom) {
  EXPECT_EQ(nominal().dof(), 6);
  EXPECT_EQ(nominal().mobility(), 3);
  EXPECT_FALSE(nominal().redundant());
  const Mechanism three = nominal();
  std::vector<Leg> four = three.legs();
  four.push_back(four.front());
  EXPECT_THROW(Mechanism("four", *three.chain(), four), InvalidInput);
}

TEST_P(Bound, PosesOnTheConstraintCloseAndKeepHeightAndTilts) {
  const Mechanism mechanism = this->mechanism();
  const RowMatrix asked = drawn(100);
  const RowMatrix poses = on_constraint(mechanism, asked);
  const RowMatrix readings = inverse_kinematics(mechanism, poses);
  for (Index leg = 0; leg < 3; ++leg) {
    const Vector closures = closure(mechanism, leg, poses, readings.col(leg));
    EXPECT_LT(closures.lpNorm<Eigen::Infinity>(), 1e-12);
  }
  const RowMatrix moved = coordinates(poses) - coordinates(asked);
  EXPECT_LT(moved.middleCols(2, 3).lpNorm<Eigen::Infinity>(), 1e-12);
  EXPECT_GT(moved.col(0).lpNorm<Eigen::Infinity>(), 1e-3);
  EXPECT_GT(moved.col(1).lpNorm<Eigen::Infinity>(), 1e-3);
  EXPECT_GT(moved.col(5).lpNorm<Eigen::Infinity>(), 1e-3);
  EXPECT_LT((on_constraint(mechanism, poses) - poses).lpNorm<Eigen::Infinity>(), 1e-12);
}

TEST_P(Bound, PosesFarTiltedKeepTheirTiltsToo) {
  Vector step(6);
  step << 0, 0, GetParam() ? 0.7 : 1.6, 1.1, -0.8, 0;
  const Vector origin = identity_pose(PoseSpace::spatial);
  RowMatrix asked = origin.transpose();
  move_pose(PoseSpace::spatial, step.data(), asked.row(0).data());
  const RowMatrix pose = on_constraint(mechanism(), asked);
  ASSERT_TRUE(pose.allFinite());
  const RowMatrix moved = coordinates(pose) - coordinates(asked);
  EXPECT_LT(moved.middleCols(2, 3).lpNorm<Eigen::Infinity>(), 1e-12);
}

TEST_P(Bound, PosesWithoutOneAreNotNumbers) {
  RowMatrix poses = drawn(2);
  poses(1, 2) = std::nan("");
  const RowMatrix found = on_constraint(nominal(), poses);
  EXPECT_TRUE(found.row(0).allFinite());
  EXPECT_TRUE(found.row(1).array().isNaN().all());
}

TEST_P(Bound, ForwardKinematicsFindsThePoseThatInverseKinematicsWasGiven) {
  const Mechanism mechanism = this->mechanism();
  const RowMatrix poses = on_constraint(mechanism, drawn(100));
  const RowMatrix readings = inverse_kinematics(mechanism, poses);
  // From poses that the legs do not allow.
  const ForwardKinematicsResult found =
      forward_kinematics(mechanism, readings, on_constraint(nominal(), drawn(100)));
  EXPECT_EQ(found.converged_count(), 100);
  EXPECT_LT((coordinates(found.poses) - coordinates(poses)).lpNorm<Eigen::Infinity>(), 1e-11);
}

// By all six closures: the poses that the readings leave are isolated where it is not zero.
TEST_P(Bound, DeterminantIsThatOfAllClosuresByTheSixCoordinates) {
  const Mechanism mechanism = this->mechanism();
  const RowMatrix poses = on_constraint(mechanism, drawn(5));
  const RowMatrix readings = inverse_kinematics(mechanism, poses);
  const SingularityMeasures measures = singularity_measures(mechanism, poses, 0.5);
  for (Index i = 0; i < poses.rows(); ++i) {
    Eigen::MatrixXd all(6, 6);
    double slopes = 1;
    for (Index leg = 0; leg < 3; ++leg) {
      const ClosureRows rows =
          linearise(mechanism, leg, poses.row(i), Vector::Constant(1, readings(i, leg)));
      all.middleRows(2 * leg, 2) = rows.by_pose;
      slopes *= -rows.by_reading[0];
    }
    const double expected = all.determinant() / slopes;
    EXPECT_NEAR(measures.parallel[i], expected, 1e-12 * std::abs(expected));
  }
}

TEST_P(Bound, WorkspaceIsSampledOnTheConstraint) {
  const Mechanism mechanism = this->mechanism();
  WorkspaceOptions options;
  options.lower = options.upper = options.home = Vector::Zero(6);
  options.home = identity_pose(PoseSpace::spatial);
  options.home[2] = GetParam() ? 0.8 : 1.75;
  options.lower.segment(2, 3) << options.home[2] - 0.2, -0.3, -0.3;
  options.upper.segment(2, 3) << options.home[2] + 0.2, 0.3, 0.3;
  options.characteristic_length = 0.4;
  options.conditioning_limit = 5;
  const WorkspaceSample sample = sample_workspace(mechanism, options, 500, 1);
  EXPECT_LT((on_constraint(mechanism, sample.poses) - sample.poses).lpNorm<Eigen::Infinity>(),
            1e-12);
  const RowMatrix found = coordinates(sample.poses);
  for (Index free = 2; free < 5; ++free) {
    EXPECT_GE(found.col(free).minCoeff(), options.lower[free] - 1e-12);
    EXPECT_LE(found.col(free).maxCoeff(), options.upper[free] + 1e-12);
    EXPECT_GT(found.col(free).maxCoeff() - found.col(free).minCoeff(), 0.35);
  }
}

INSTANTIATE_TEST_SUITE_P(Mechanisms, Bound, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "ThreePrs" : "ThreeRps"; });

TEST(OnConstraint, LeavesPosesOfOtherMechanismsAsTheyAre) {
  const RowMatrix poses = RowMatrix::Random(4, 3);
  EXPECT_EQ(on_constraint(testing::paper_3rrr(), poses), poses);
}

}  // namespace
}  // namespace symkin
