// SPDX-License-Identifier: MIT
#include "symkin/estimation/leg_rows.hpp"

#include <gtest/gtest.h>

#include <type_traits>

#include "design/small_problems.hpp"
#include "support/mechanisms.hpp"
#include "symkin/support/error.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin::testing {
namespace {

constexpr Index kKeepsNothing = 0;
constexpr Index kKeepsAll = Index{768} << 20U;

class GeneratedRows : public ::testing::Test {
 protected:
  const Mechanism mechanism = paper_3rrr();
  const SymmetryGroup group = SymmetryGroup::named("C3");
  const RowMatrix poses = sample_workspace(mechanism, paper_workspace(), 20'000, 1).poses;

  // Candidate by candidate, an element a row.
  RowMatrix orbit_rows(Index leg, RowKind kind) const {
    const auto r = static_cast<Index>(group.elements().size());
    RowMatrix rows(r * poses.rows(), mechanism.parameter_count());
    for (Index k = 0; k < r; ++k) {
      const RowMatrix carried = transform_poses(
          group, group.elements()[static_cast<std::size_t>(k)], mechanism.pose_space(), poses);
      const RowMatrix of_element = observability_rows(mechanism, leg, carried, kind);
      for (Index j = 0; j < poses.rows(); ++j) {
        rows.row(r * j + k) = of_element.row(j);
      }
    }
    return rows;
  }

  // The same selection, whatever is kept and on any number of threads.
  static void expect_same(const RowSource& generated, const CandidateRows& in_memory, Index count) {
    SelectionOptions options = options_for(count, SelectionMethod::exchange);
    options.spare_count = 3;
    options.threads = 1;
    const Selection expected = select_poses(in_memory, options);
    for (const Index limit : {kKeepsNothing, kKeepsAll}) {
      options.memory_limit_bytes = limit;
      for (options.threads = 1; options.threads <= 2; ++options.threads) {
        const Selection found = select_poses(generated, options);
        EXPECT_EQ(found.indices, expected.indices);
        EXPECT_EQ(found.spares, expected.spares);
        EXPECT_EQ(found.log_det, expected.log_det);
        EXPECT_EQ(found.certificate.log_det_bound_distinct,
                  expected.certificate.log_det_bound_distinct);
      }
    }
  }
};

TEST_F(GeneratedRows, OfOneLegGiveTheSameSelectionAsAMatrix) {
  for (const RowKind kind : {RowKind::paper, RowKind::noise_aware}) {
    const RowMatrix rows = observability_rows(mechanism, 1, poses, kind);
    expect_same(LegRows(mechanism, 1, poses, kind), CandidateRows{rows}, 24);
  }
}

TEST_F(GeneratedRows, OfOrbitsGiveTheSameSelectionAsAMatrix) {
  const RowMatrix rows = orbit_rows(0, RowKind::paper);
  expect_same(LegRows(mechanism, 0, poses, RowKind::paper, {}, Orbit::of(group, group.elements())),
              CandidateRows{rows, 3}, 8);
}

TEST_F(GeneratedRows, FillAnyPartOfThem) {
  const RowMatrix rows = orbit_rows(2, RowKind::paper);
  const LegRows generated(mechanism, 2, poses, RowKind::paper, {},
                          Orbit::of(group, group.elements()));
  RowMatrix part(3 * 5, 8);
  generated.fill(777, 5, part.data());
  EXPECT_EQ(part, rows.middleRows(3 * 777, 3 * 5));
}

TEST_F(GeneratedRows, OfACandidateOutOfReachAreRefusedByItsIndexUnlessForbidden) {
  RowMatrix some = poses.topRows(3000);
  some.row(2345).setConstant(10);
  const LegRows generated(mechanism, 0, some, RowKind::paper);
  SelectionOptions options = options_for(24, SelectionMethod::exchange);
  for (const Index limit : {kKeepsNothing, kKeepsAll}) {
    options.memory_limit_bytes = limit;
    options.forbidden.clear();
    try {
      select_poses(generated, options);
      FAIL() << "no leg reaches 10 m";
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find("candidate 2345 has a row that is not finite"),
                std::string::npos)
          << error.what();
    }
    options.forbidden.assign(3000, false);
    options.forbidden[2345] = true;
    EXPECT_EQ(select_poses(generated, options).indices.size(), 24U);
  }
}

// Poses that would be gone before they are used do not compile.
static_assert(std::is_constructible_v<LegRows, Mechanism, Index, const RowMatrix&, RowKind>);
static_assert(!std::is_constructible_v<LegRows, Mechanism, Index, RowMatrix, RowKind>);
static_assert(!std::is_constructible_v<RowsInMemory, CandidateRows>);

TEST_F(GeneratedRows, OutliveTheMechanism) {
  const LegRows generated(paper_3rrr(), 0, poses, RowKind::paper);
  RowMatrix part(5, 8);
  generated.fill(777, 5, part.data());
  EXPECT_EQ(part, observability_rows(mechanism, 0, poses, RowKind::paper).middleRows(777, 5));
}

TEST_F(GeneratedRows, NeedAnOrbitWithElementsAndALegThatExists) {
  EXPECT_THROW(LegRows(mechanism, 0, poses, RowKind::paper, {}, Orbit{}), InvalidInput);
  EXPECT_THROW(LegRows(mechanism, 0, poses, RowKind::paper, {}, Orbit::of(group, {{0, true}})),
               InvalidInput);
  EXPECT_THROW(LegRows(mechanism, 3, poses, RowKind::paper), InvalidInput);
  const RowMatrix flat = poses.leftCols(2);
  EXPECT_THROW(LegRows(mechanism, 0, flat, RowKind::paper), InvalidInput);
}

}  // namespace
}  // namespace symkin::testing
