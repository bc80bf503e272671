// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <vector>

#include "support/mixed_mechanisms.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/detection.hpp"
#include "symkin/symmetry/verification.hpp"
#include "symkin/symmetry/workspace_symmetry.hpp"

namespace symkin {
namespace {

using Legs = std::vector<Index>;

// The mechanism with everything drawn about other centres and turned.
Mechanism elsewhere(const Mechanism& mechanism) {
  // Two reflections about lines that meet in neither frame's origin.
  std::vector<Leg> legs = mechanism.legs();
  for (const double axis : {0.2, 1.1}) {
    SymmetryFrame frame;
    frame.base_centre = {0.3, -0.2};
    frame.platform_centre = {-0.05, 0.1};
    frame.base_axis = axis;
    frame.platform_axis = -2 * axis;
    const SymmetryGroup group(1, true, frame);
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      Leg& each = legs[static_cast<std::size_t>(leg)];
      each = transform_leg(group, {0, true}, mechanism.model(leg).info(), each);
    }
  }
  return mechanism.with_legs(legs);
}

TEST(MixedSymmetry, AMirrorExchangesTheLegsOfOneChainAndKeepsThatOfTheOther) {
  const Mechanism drawn = testing::cranks_and_slider().mechanism;
  for (const Mechanism& mechanism : {drawn, elsewhere(drawn)}) {
    const DetectedSymmetry found = detect_symmetry(mechanism);
    EXPECT_EQ(found.structure.name(), "D_1");
    ASSERT_EQ(found.images.size(), 2U);
    EXPECT_EQ(found.images[1].permutation, (Legs{1, 0, 2}));
    // The elbows turn the other way, and the slider goes to the other side.
    EXPECT_EQ(found.with_modes.name(), "C_1");
    for (const LegDeviation& deviation : found.images[1].deviations) {
      EXPECT_FALSE(deviation.same_mode);
    }
  }
}

TEST(MixedSymmetry, ALegOfAnotherChainIsItsOwnReference) {
  const Mechanism drawn = testing::cranks_and_slider().mechanism;
  std::vector<Leg> legs = drawn.legs();
  legs[1].working_mode = -1;  // the image of the first leg's
  for (const Mechanism& mechanism : {drawn.with_legs(legs), elsewhere(drawn.with_legs(legs))}) {
    const DetectedSymmetry found = detect_symmetry(mechanism);
    const std::vector<Carrier> carriers =
        leg_carriers(mechanism, found.structure, SymmetryTolerance());
    EXPECT_EQ(carriers[1].reference, 0);
    EXPECT_EQ(carriers[1].element, (SymmetryElement{0, true}));
    EXPECT_EQ(carriers[2].reference, 2);
    const RowMatrix deviations =
        symmetry_deviations(mechanism, found.structure, SymmetryTolerance());
    EXPECT_LT(deviations.leftCols(6).norm(), 1e-9);
  }
}

TEST(MixedSymmetry, AMirrorIsFoundAlongTheGuideOfTheLegOnItToo) {
  const Mechanism drawn = testing::cranks_and_slider().mechanism;
  RowMatrix parameters = drawn.parameters();
  parameters(2, 2) = 0;  // along the Y axis
  parameters(2, 3) = 0;
  const DetectedSymmetry found = detect_symmetry(drawn.with_parameters(parameters));
  EXPECT_EQ(found.structure.name(), "D_1");
  EXPECT_EQ(found.images[1].permutation, (Legs{1, 0, 2}));
}

// A slot of the platform along the mirror: its normal crosses it, and is its own image turned
// round, while the platform's points lie on either side.
TEST(MixedSymmetry, AMirrorIsFoundBesideASlotOfThePlatformToo) {
  const Mechanism cranks = testing::paper_3rrr(1);
  std::vector<Leg> small{cranks.leg(0), cranks.leg(1)};
  for (Leg& leg : small) {
    leg.parameters[4] = 0.3;  // of the platform, which must not outweigh the slot
  }
  Vector slotted(6);  // OA, beta, ob, beta_b, gain, offset
  slotted << 0.5, kPi / 2, 0, 0, 1, 0;
  const Mechanism mechanism =
      testing::mixed_mechanism("slotted", {{cranks.chain(), small[0]},
                                           {cranks.chain(), small[1]},
                                           {&leg_model("[P]RP"), {slotted, -1}}});
  const DetectedSymmetry found = detect_symmetry(mechanism);
  EXPECT_EQ(found.structure.name(), "D_1");
  ASSERT_EQ(found.images.size(), 2U);
  EXPECT_EQ(found.images[1].permutation, (Legs{1, 0, 2}));
}

TEST(MixedSymmetry, ALegOffTheMirrorBreaksIt) {
  const Mechanism drawn = testing::cranks_and_slider().mechanism;
  RowMatrix parameters = drawn.parameters();
  parameters(2, 5) += 0.1;
  EXPECT_EQ(detect_symmetry(drawn.with_parameters(parameters)).structure.name(), "C_1");
}

TEST(MixedSymmetry, ARotationCarriesEachChainsLegsOntoEachOther) {
  const Mechanism mechanism = testing::struts_and_sliders().mechanism;
  const DetectedSymmetry found = detect_symmetry(mechanism);
  EXPECT_EQ(found.structure.name(), "C_3");
  EXPECT_EQ(found.with_modes.name(), "C_3");
  EXPECT_EQ(found.images[1].permutation, (Legs{2, 3, 4, 5, 0, 1}));
  const std::vector<Carrier> carriers = leg_carriers(mechanism, found.structure);
  for (Index leg = 0; leg < 6; ++leg) {
    EXPECT_EQ(carriers[static_cast<std::size_t>(leg)].reference, leg % 2);
  }
  EXPECT_LT(symmetry_deviations(mechanism, found.structure, SymmetryTolerance()).norm(), 1e-9);
}

// Three legs of a 3-RRR of which one is of another chain, though no parameter tells it.
TEST(MixedSymmetry, LegsOfDifferentChainsAreNeverExchanged) {
  const Mechanism alike = testing::paper_3rrr();
  const Mechanism mechanism("mixed", {alike.chain(), alike.chain(), &leg_model("R[R]R")},
                            alike.legs());
  EXPECT_EQ(detect_symmetry(alike).structure.name(), "D_3");
  const DetectedSymmetry found = detect_symmetry(mechanism);
  EXPECT_EQ(found.structure.name(), "D_1");
  EXPECT_EQ(found.images[1].permutation, (Legs{1, 0, 2}));
  EXPECT_THROW(verify_symmetry(mechanism, SymmetryGroup::named("C3")), SymmetryMismatch);
  EXPECT_THROW(observability_group(mechanism, SymmetryGroup::named("C3")), SymmetryMismatch);
}

TEST(MixedSymmetry, MapsTheWorkspaceOntoThatOfTheImagesModes) {
  for (auto [given, workspace] : {testing::cranks_and_slider(), testing::struts_and_sliders()}) {
    RowMatrix parameters = given.parameters();
    const Index last = given.leg_count() - 1;
    parameters(last, parameters.cols() - 1) = given.dof() == 3 ? 0 : 0.1;  // read from the mirror
    const Mechanism mechanism = given.with_parameters(parameters);
    const DetectedSymmetry found = detect_symmetry(mechanism);
    // A limit of the sliders alone.
    const RowMatrix home = inverse_kinematics(mechanism, workspace.home.transpose());
    workspace.reading_lower = Vector::Constant(mechanism.leg_count(), -10);
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      if (mechanism.of_one_chain(leg, last)) {
        workspace.reading_lower[leg] = home(0, last) - 0.08;
      }
    }
    const WorkspaceSymmetry result =
        verify_workspace_symmetry(mechanism, workspace, found.structure,
                                  {found.images.back().element}, 300, 5)
            .front();
    EXPECT_GT(result.inside, 20) << mechanism.name();
    EXPECT_LT(result.inside, 280) << mechanism.name();
    EXPECT_EQ(result.mismatches, 0) << mechanism.name();
    EXPECT_LT(result.reading_deviation, 1e-9) << mechanism.name();
  }
}

}  // namespace
}  // namespace symkin
