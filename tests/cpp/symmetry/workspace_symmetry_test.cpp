// SPDX-License-Identifier: MIT
#include "symkin/symmetry/workspace_symmetry.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/support/error.hpp"
#include "symkin/symmetry/detection.hpp"

namespace symkin {
namespace {

TEST(WorkspaceSymmetry, TheoremAndConjectureHoldForEveryElementOfTheStructure) {
  const std::pair<Mechanism, WorkspaceOptions> examples[] = {
      {testing::paper_3rrr(), testing::paper_workspace()},
      {testing::hexapod(), testing::hexapod_workspace()}};
  for (const auto& [mechanism, workspace] : examples) {
    const DetectedSymmetry found = detect_symmetry(mechanism);
    const std::vector<SymmetryElement> elements = found.structure.elements();
    const std::vector<WorkspaceSymmetry> results =
        verify_workspace_symmetry(mechanism, workspace, found.structure, elements, 5000, 1);
    ASSERT_EQ(results.size(), elements.size());
    for (const WorkspaceSymmetry& result : results) {
      EXPECT_EQ(result.mismatches, 0) << SymmetryGroup::label(result.element);
      EXPECT_LT(result.reading_deviation, 1e-11) << SymmetryGroup::label(result.element);
      EXPECT_GT(result.inside, 100);
      EXPECT_EQ(result.tested, 5000);
    }
  }
}

TEST(WorkspaceSymmetry, FailsVisiblyOnAMechanismThatIsOnlyRoughlySymmetric) {
  RowMatrix parameters = testing::paper_3rrr().parameters();
  parameters(0, 0) += 0.02;
  const Mechanism rough = testing::paper_3rrr().with_parameters(parameters);
  const SymmetryGroup group = SymmetryGroup::named("C3");
  const std::vector<SymmetryElement> turn = {{1, false}};
  const WorkspaceSymmetry result = verify_workspace_symmetry(rough, testing::paper_workspace(),
                                                             group, turn, 5000, 1, {0.1, 0.1, 0.1})
                                       .front();
  EXPECT_GT(result.mismatches, 0);
  EXPECT_GT(result.reading_deviation, 1e-3);
  EXPECT_THROW(verify_workspace_symmetry(rough, testing::paper_workspace(), group, turn, 10, 1),
               SymmetryMismatch);
}

}  // namespace
}  // namespace symkin
