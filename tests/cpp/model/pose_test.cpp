// SPDX-License-Identifier: MIT
#include "symkin/model/pose.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "symkin/model/frame.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

TEST(Pose, MovingAPoseAndTakingTheDifferenceAreInverse) {
  Random random(1);
  for (const PoseSpace space : {PoseSpace::planar, PoseSpace::point, PoseSpace::spatial,
                                PoseSpace::translating, PoseSpace::spherical}) {
    for (int i = 0; i < 100; ++i) {
      Vector step(degrees_of_freedom(space));
      Vector start_step(degrees_of_freedom(space));
      for (Index k = 0; k < step.size(); ++k) {
        step[k] = random.uniform() - 0.5;
        start_step[k] = 2 * random.uniform() - 1;
      }
      Vector from = identity_pose(space);
      move_pose(space, start_step.data(), from.data());
      Vector to = from;
      move_pose(space, step.data(), to.data());
      Vector difference(step.size());
      pose_difference(space, to.data(), from.data(), difference.data());
      EXPECT_LT((difference - step).norm(), 1e-13) << to_string(space);
    }
  }
}

TEST(Pose, TheRotationVectorTurnsAboutTheBaseFramesAxes) {
  Vector pose = identity_pose(PoseSpace::spatial);
  Vector about_x = Vector::Zero(6);
  about_x[3] = M_PI / 2;
  Vector about_z = Vector::Zero(6);
  about_z[5] = M_PI / 2;
  move_pose(PoseSpace::spatial, about_x.data(), pose.data());
  move_pose(PoseSpace::spatial, about_z.data(), pose.data());
  // The platform's y axis went to Z with the first turn and stays there with the second.
  const Eigen::Matrix3d rotation = rotation_matrix(pose.data() + 3);
  EXPECT_LT((rotation.col(1) - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
}

TEST(Pose, TheSameRotationWithTheOppositeQuaternionIsNoDifference) {
  Vector pose = identity_pose(PoseSpace::spatial);
  Vector opposite = pose;
  opposite.tail(4) *= -1;
  Vector difference(6);
  pose_difference(PoseSpace::spatial, opposite.data(), pose.data(), difference.data());
  EXPECT_EQ(difference.norm(), 0);
}

TEST(Pose, AnglesAreWrappedIntoHalfATurnEitherWay) {
  EXPECT_DOUBLE_EQ(wrap_angle(3 * M_PI), M_PI);
  EXPECT_DOUBLE_EQ(wrap_angle(-M_PI), M_PI);
  EXPECT_NEAR(wrap_angle(-7.0), -7.0 + 2 * M_PI, 1e-15);
  EXPECT_EQ(wrap_angle(0.25), 0.25);
}

TEST(Pose, DifferencesOfAnglesTakeTheShortWayAcrossHalfATurn) {
  const Eigen::Vector3d from(0, 0, 3.0);
  const Eigen::Vector3d to(0, 0, -3.0);
  Eigen::Vector3d difference;
  pose_difference(PoseSpace::planar, to.data(), from.data(), difference.data());
  EXPECT_NEAR(difference[2], 2 * M_PI - 6, 1e-14);
}

TEST(Pose, DifferencesOfRotationsTakeTheShortWayWhicheverQuaternionsAreGiven) {
  for (const double sign : {1.0, -1.0}) {
    Vector from = identity_pose(PoseSpace::spherical);
    Vector to = from;
    const Eigen::Vector3d turn(0.3, -0.2, 0.4);
    move_pose(PoseSpace::spherical, turn.data(), to.data());
    to *= sign;
    Eigen::Vector3d difference;
    pose_difference(PoseSpace::spherical, to.data(), from.data(), difference.data());
    EXPECT_LT((difference - turn).norm(), 1e-14) << sign;
  }
}

TEST(Pose, TheLeftJacobianIsTheDerivativeOfTheRotation) {
  // exp([w + d]) = exp([J d]) exp([w]), by central differences; small angles by their series.
  for (const double size : {1.0, 1e-3}) {
    const Eigen::Vector3d w = size * Eigen::Vector3d(0.8, -0.5, 1.1);
    for (Index k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = 1e-5 * Eigen::Vector3d::Unit(k);
      const Eigen::Matrix3d turn = rotation_of(w + d) * rotation_of(w - d).transpose();
      const Eigen::Vector3d moved =
          Eigen::Vector3d(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0),
                          turn(1, 0) - turn(0, 1)) /
          4e-5;
      EXPECT_LT((left_jacobian(w).col(k) - moved).norm(), 1e-8) << size << " " << k;
    }
  }
}

TEST(Frame, ItsInverseUndoesIt) {
  const Frame frame{{1, 2, 3}, rotation_of({0.3, -0.7, 0.5})};
  for (const Frame& both : {frame * frame.inverse(), frame.inverse() * frame}) {
    EXPECT_LT(both.position.norm(), 1e-15);
    EXPECT_LT((both.rotation - Eigen::Matrix3d::Identity()).norm(), 1e-15);
  }
}

TEST(Frame, IsTurnedAboutTheAxesOfTheFrameThatItIsGivenIn) {
  const Frame frame{{1, 2, 3}, rotation_of({M_PI / 2, 0, 0})};
  Eigen::Matrix<double, 6, 1> step;
  step << 0.1, 0, 0, 0, 0, M_PI / 2;
  const Frame after = moved(frame, step);
  EXPECT_LT((after.position - Eigen::Vector3d(1.1, 2, 3)).norm(), 1e-15);
  // Its y axis pointed along Z, about which it was turned.
  EXPECT_LT((after.rotation.col(1) - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
}

}  // namespace
}  // namespace symkin
