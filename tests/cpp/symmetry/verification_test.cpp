// SPDX-License-Identifier: MIT
#include "symkin/symmetry/verification.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/support/error.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin {
namespace {

TEST(SymmetryVerification, The3RrrHasD3AsStructureAndC3WithItsModes) {
  const Mechanism mechanism = testing::paper_3rrr();
  const SymmetryGroup group = SymmetryGroup::named("D3", M_PI / 2);
  for (const SymmetryElement element : group.elements()) {
    const ElementImage image = image_of_legs(mechanism, group, element);
    EXPECT_TRUE(image.keeps_structure) << SymmetryGroup::label(element);
    EXPECT_EQ(image.keeps_modes, !element.reflection) << SymmetryGroup::label(element);
  }
  EXPECT_NO_THROW(verify_symmetry(mechanism, group));
}

TEST(SymmetryVerification, TheHexapodsReflectionsKeepItsModes) {
  const SymmetryGroup group = SymmetryGroup::named("D3", 210 * M_PI / 180);
  const auto carriers = observability_group(testing::hexapod(), group);
  std::vector<std::string> labels;
  for (const auto element : carriers) {
    labels.push_back(SymmetryGroup::label(element));
  }
  EXPECT_EQ(labels, (std::vector<std::string>{"r0", "s0", "r1", "s1", "r2", "s2"}));
}

TEST(SymmetryVerification, NamesLegParameterAndDeviationOfWhatBreaksIt) {
  RowMatrix parameters = testing::paper_3rrr().parameters();
  parameters(2, 4) += 0.002;
  const Mechanism broken = testing::paper_3rrr().with_parameters(parameters);
  try {
    verify_symmetry(broken, SymmetryGroup::named("C3"));
    FAIL();
  } catch (const SymmetryMismatch& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("platform_radius"), std::string::npos) << message;
    EXPECT_NE(message.find("leg 3"), std::string::npos) << message;
    EXPECT_NE(message.find("0.002"), std::string::npos) << message;
  }
  EXPECT_NO_THROW(verify_symmetry(broken, SymmetryGroup::named("C3"), {0.01, 0.01, 0.01}));
}

TEST(SymmetryVerification, TwoLegsThatAreCarriedOntoOneAreNoSymmetry) {
  // Half a turn carries both twins onto the leg opposite, which has one image.
  const Mechanism mechanism = testing::paper_3rrr();
  const SymmetryGroup group = SymmetryGroup::named("C2");
  const Leg& twin = mechanism.leg(0);
  const SymmetryElement half = group.elements()[1];
  const Leg opposite = transform_leg(group, half, mechanism.chain()->info(), twin);
  const Mechanism twins("twins", *mechanism.chain(), {twin, twin, opposite});
  const ElementImage image = image_of_legs(twins, group, half);
  EXPECT_EQ(image.permutation, (std::vector<Index>{2, 2, 0}));
  EXPECT_FALSE(image.keeps_structure);
  EXPECT_THROW(verify_symmetry(twins, group), SymmetryMismatch);
}

TEST(SymmetryVerification, RefusesAWrongNumberOfLegs) {
  EXPECT_THROW(generating_elements(SymmetryGroup::named("C3"), 4), InvalidInput);
  EXPECT_THROW(generating_elements(SymmetryGroup::named("D3"), 4), InvalidInput);
}

}  // namespace
}  // namespace symkin
