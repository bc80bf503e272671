// SPDX-License-Identifier: MIT
#include "symkin/symmetry/action.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

// A frame off the origin in base and platform, and turned differently in both.
SymmetryFrame shifted_frame() {
  SymmetryFrame frame;
  frame.base_centre = {0.3, -0.2};
  frame.platform_centre = {-0.05, 0.1};
  frame.base_axis = 0.4;
  frame.platform_axis = -0.9;
  return frame;
}

Mechanism image_of(const Mechanism& mechanism, const SymmetryGroup& group,
                   SymmetryElement element) {
  std::vector<Leg> legs;
  for (const Leg& leg : mechanism.legs()) {
    legs.push_back(transform_leg(group, element, mechanism.model(0).info(), leg));
  }
  return {"image", *mechanism.chain(), legs};
}

class Action : public ::testing::TestWithParam<SymmetryGroup> {};

INSTANTIATE_TEST_SUITE_P(Groups, Action,
                         ::testing::Values(SymmetryGroup::named("D3", 0.7),
                                           SymmetryGroup(5, true, shifted_frame())),
                         [](const auto& info) {
                           return std::string(info.index == 0 ? "AboutTheOrigin" : "OffTheOrigin");
                         });

TEST_P(Action, ImagesOfLegsReadTheImagesOfReadingsAtTheImagesOfPoses) {
  const SymmetryGroup& group = GetParam();
  const std::pair<Mechanism, WorkspaceOptions> examples[] = {
      {testing::paper_3rrr(), testing::paper_workspace()},
      {testing::hexapod(), testing::hexapod_workspace()}};
  for (const auto& [mechanism, workspace] : examples) {
    const RowMatrix poses = sample_workspace(mechanism, workspace, 50, 9).poses;
    const RowMatrix readings = inverse_kinematics(mechanism, poses);
    for (const SymmetryElement element : group.elements()) {
      const RowMatrix image_readings =
          inverse_kinematics(image_of(mechanism, group, element),
                             transform_poses(group, element, mechanism.pose_space(), poses));
      const double sign = reading_sign(element, mechanism.model(0).info().active_joint);
      EXPECT_LT((image_readings - sign * readings).cwiseAbs().maxCoeff(), 1e-11)
          << SymmetryGroup::label(element);
    }
  }
}

TEST_P(Action, ComposesAsTheGroupDoes) {
  const SymmetryGroup& group = GetParam();
  const Mechanism mechanism = testing::hexapod();
  const RowMatrix poses = sample_workspace(mechanism, testing::hexapod_workspace(), 5, 9).poses;
  for (const SymmetryElement a : group.elements()) {
    for (const SymmetryElement b : group.elements()) {
      const RowMatrix twice = transform_poses(group, a, PoseSpace::spatial,
                                              transform_poses(group, b, PoseSpace::spatial, poses));
      const RowMatrix once = transform_poses(group, group.compose(a, b), PoseSpace::spatial, poses);
      Vector difference(6);
      for (Index i = 0; i < poses.rows(); ++i) {
        pose_difference(PoseSpace::spatial, twice.row(i).data(), once.row(i).data(),
                        difference.data());
        EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-13);
      }
    }
  }
}

TEST(Action, RefusesPosesAndLegsOfOtherShapes) {
  const SymmetryGroup group = SymmetryGroup::named("C3");
  const Mechanism mechanism = testing::paper_3rrr();
  EXPECT_THROW(transform_poses(group, {1, false}, PoseSpace::spatial, RowMatrix::Zero(2, 3)),
               InvalidInput);
  const Leg three{Vector::Ones(3), 1};
  EXPECT_THROW(transform_leg(group, {1, false}, mechanism.model(0).info(), three), InvalidInput);
  EXPECT_THROW(generate_legs(group, mechanism.model(0), three, {{1, false}}), InvalidInput);
}

}  // namespace
}  // namespace symkin
