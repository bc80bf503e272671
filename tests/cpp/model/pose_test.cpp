// SPDX-License-Identifier: MIT
#include "symkin/model/pose.hpp"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace symkin
