// SPDX-License-Identifier: MIT
#include "symkin/kinematics/workspace.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

TEST(Workspace, EverySampleMeetsEveryDemand) {
  const Mechanism mechanism = testing::paper_3rrr();
  const WorkspaceOptions options = testing::paper_workspace();
  const WorkspaceSample sample = sample_workspace(mechanism, options, 3000, 1);
  EXPECT_GE(reach_margin(mechanism, sample.poses).minCoeff(), options.reach_margin);
  const SingularityMeasures measures = singularity_measures(mechanism, sample.poses, 1);
  EXPECT_LE(measures.condition.maxCoeff(), options.conditioning_limit);
  const double home = singularity_measures(mechanism, options.home.transpose(), 1).parallel[0];
  EXPECT_TRUE((measures.parallel.array() * home > 0).all());
  EXPECT_EQ(sample.readings, inverse_kinematics(mechanism, sample.poses));
}

TEST(Workspace, TheSameSeedGivesTheSamePosesAndAnotherOthers) {
  const Mechanism mechanism = testing::paper_3rrr();
  const WorkspaceOptions options = testing::paper_workspace();
  const RowMatrix first = sample_workspace(mechanism, options, 200, 7).poses;
  EXPECT_EQ(first, sample_workspace(mechanism, options, 200, 7).poses);
  EXPECT_NE(first, sample_workspace(mechanism, options, 200, 8).poses);
  EXPECT_EQ(first.topRows(50), sample_workspace(mechanism, options, 50, 7).poses);
}

TEST(Workspace, InsideAgreesWithTheSample) {
  const Mechanism mechanism = testing::hexapod();
  const WorkspaceOptions options = testing::hexapod_workspace();
  RowMatrix poses = sample_workspace(mechanism, options, 20, 2).poses;
  poses(3, 0) = 50;  // far to the side: nearly parallel legs
  const std::vector<bool> inside = inside_workspace(mechanism, options, poses);
  for (Index i = 0; i < 20; ++i) {
    EXPECT_EQ(inside[static_cast<std::size_t>(i)], i != 3) << i;
  }
}

TEST(Workspace, ReadingLimitsAreKept) {
  const Mechanism mechanism = testing::paper_3rrr();
  WorkspaceOptions options = testing::paper_workspace();
  const WorkspaceSample all = sample_workspace(mechanism, options, 500, 1);
  options.reading_lower[0] = 0.9 * all.readings.minCoeff() + 0.1 * all.readings.maxCoeff();
  const WorkspaceSample limited = sample_workspace(mechanism, options, 500, 1);
  EXPECT_GE(limited.readings.minCoeff(), options.reading_lower[0]);
  EXPECT_GT(limited.rejections.limits, 0);
}

TEST(Workspace, SaysWhyHomeIsNotInIt) {
  const Mechanism mechanism = testing::paper_3rrr();
  WorkspaceOptions options = testing::paper_workspace();
  options.home = Eigen::Vector3d(3, 0, 0);
  try {
    sample_workspace(mechanism, options, 10, 1);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("home"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("reach"), std::string::npos);
  }
}

TEST(Workspace, GivesUpOnABoxWithoutPosesInsteadOfSearchingForEver) {
  const Mechanism mechanism = testing::paper_3rrr();
  WorkspaceOptions options = testing::paper_workspace();
  options.lower[0] = 5;
  options.upper[0] = 6;
  EXPECT_THROW(sample_workspace(mechanism, options, 10, 1), InvalidInput);
}

TEST(Workspace, RefusesBoundsOfTheWrongNumberOrOrder) {
  const Mechanism mechanism = testing::paper_3rrr();
  WorkspaceOptions options = testing::paper_workspace();
  options.upper[2] = -1;
  EXPECT_THROW(sample_workspace(mechanism, options, 10, 1), InvalidInput);
  options.upper = Eigen::Vector2d(1, 1);
  EXPECT_THROW(sample_workspace(mechanism, options, 10, 1), InvalidInput);
}

}  // namespace
}  // namespace symkin
