// SPDX-License-Identifier: MIT
#include "symkin/symmetry/group.hpp"

#include <gtest/gtest.h>

#include "symkin/support/error.hpp"

namespace symkin {
namespace {

TEST(SymmetryGroup, CompositionIsAssociativeWithNeutralAndInverse) {
  for (const char* name : {"C1", "C4", "D1", "D3", "D6"}) {
    const SymmetryGroup group = SymmetryGroup::named(name);
    for (const auto a : group.elements()) {
      EXPECT_EQ(group.compose(a, SymmetryElement{}), a);
      EXPECT_EQ(group.compose(a, group.inverse(a)), SymmetryElement{});
      for (const auto b : group.elements()) {
        for (const auto c : group.elements()) {
          EXPECT_EQ(group.compose(group.compose(a, b), c), group.compose(a, group.compose(b, c)));
        }
      }
    }
  }
}

TEST(SymmetryGroup, HasThePapersNameAndTheUsualOne) {
  const SymmetryGroup group = SymmetryGroup::named("D3");
  EXPECT_EQ(group.paper_name(), "D_6");
  EXPECT_EQ(group.name(), "D_3");
  EXPECT_EQ(group.size(), 6);
}

TEST(SymmetryGroup, LabelsReadBack) {
  const SymmetryGroup group = SymmetryGroup::named("D4");
  for (const auto element : group.elements()) {
    EXPECT_EQ(group.parse(SymmetryGroup::label(element)), element);
  }
}

TEST(SymmetryGroup, RefusesUnknownNamesAndElements) {
  for (const char* name : {"", "C", "C0", "E3", "D3x"}) {
    EXPECT_THROW(SymmetryGroup::named(name), InvalidInput) << name;
  }
  EXPECT_THROW(SymmetryGroup::named("C3").parse("s0"), InvalidInput);
  EXPECT_THROW(SymmetryGroup::named("D3").parse("r3"), InvalidInput);
}

TEST(SymmetryGroup, RefusesElementsOfOtherGroups) {
  const SymmetryGroup group = SymmetryGroup::named("C3");
  for (const SymmetryElement element : {SymmetryElement{3, false}, {-1, false}, {0, true}}) {
    EXPECT_THROW(group.angle(element), InvalidInput);
    EXPECT_THROW(group.inverse(element), InvalidInput);
    EXPECT_THROW(group.compose({0, false}, element), InvalidInput);
  }
}

}  // namespace
}  // namespace symkin
