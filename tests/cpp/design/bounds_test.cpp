// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "design/small_problems.hpp"
#include "support/paper_leg.hpp"
#include "symkin/design/detail/bounds.hpp"
#include "symkin/support/dense.hpp"

namespace symkin::testing {
namespace {

using design::detail::determinant_bound;
using design::detail::largest_sum;
using design::detail::RankedCandidate;

TEST(Bounds, NoDesignOfASmallProblemExceedsTheCertificate) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const Index r : {Index{1}, Index{2}}) {
      const RowMatrix rows = random_rows(r * 12, 3, seed);
      const Certificate certificate =
          select_poses(CandidateRows{rows, r}, options_for(5, SelectionMethod::exchange))
              .certificate;
      EXPECT_LE(certificate.log_det_bound_distinct, certificate.log_det_bound_repeats);
      for_each_subset(12, 5, [&](const std::vector<Index>& chosen) {
        EXPECT_LE(log_det(information(rows, r, chosen)), certificate.log_det_bound_distinct);
      });
    }
  }
}

TEST(Bounds, DesignsWithRepeatsStayBelowTheirBoundAndMayExceedTheOther) {
  int exceeded = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const RowMatrix rows = random_rows(8, 2, seed);
    const Certificate certificate =
        select_poses(CandidateRows{rows}, options_for(4, SelectionMethod::exchange)).certificate;
    RowMatrix repeated(4 * 8, 2);
    for (Index copy = 0; copy < 4; ++copy) {
      repeated.middleRows(8 * copy, 8) = rows;
    }
    const Best best = enumerate(repeated, 1, 4, log_det);
    EXPECT_LE(best.value, certificate.log_det_bound_repeats);
    exceeded += best.value > certificate.log_det_bound_distinct ? 1 : 0;
  }
  EXPECT_GT(exceeded, 0);
}

// The weights' error and its bound meet in a few passes, so the rest is what whole poses cost.
TEST(Bounds, TheLeastExpectedErrorOfManyPosesIsKnownTightly) {
  for (const Index r : {Index{1}, Index{3}}) {
    const RowMatrix rows = random_rows(r * 3000, 6, 11);
    const RowMatrix root = random_rows(6, 6, 12);
    SelectionOptions options = options_for(60, SelectionMethod::exchange);
    options.criterion = Criterion::expected_error;
    options.error_weight = root.transpose() * root;
    EXPECT_GT(select_poses(CandidateRows{rows, r}, options).certificate.criterion_efficiency, 0.999)
        << r;
  }
}

TEST(Bounds, AnyFactorGivesABound) {
  const RowMatrix rows = random_rows(12, 3, 1);
  const Best best = enumerate(rows, 1, 5, log_det);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const RowMatrix root = random_rows(6, 3, seed);
    const RowMatrix factor = inverse_factor(root.transpose() * root);
    std::vector<RankedCandidate> d;
    for (Index j = 0; j < rows.rows(); ++j) {
      d.push_back({j, (factor * rows.row(j).transpose()).squaredNorm()});
    }
    std::sort(d.begin(), d.end(), [](const auto& a, const auto& b) { return a.value > b.value; });
    EXPECT_GE(determinant_bound(factor, largest_sum(d, 5)), best.value);
  }
}

// det(T)^-2 (trace / p)^p is exact for an orthogonal design: slack may add a few ulps, not more.
TEST(Bounds, TheBoundOfAnOrthogonalDesignIsTight) {
  const RowMatrix factor = RowMatrix::Identity(4, 4) / 3;
  EXPECT_NEAR(determinant_bound(factor, 4), 8 * std::log(3.0), 1e-12);
  EXPECT_GE(determinant_bound(factor, 4), 8 * std::log(3.0));
}

TEST(Bounds, EfficienciesOfThePaperLegAreNearOne) {
  const RowMatrix rows = paper_rows(paper_poses(5000));
  const Selection found =
      select_poses(CandidateRows{rows}, options_for(24, SelectionMethod::exchange));
  EXPECT_GT(found.certificate.efficiency_distinct, 0.98);
  EXPECT_LE(found.certificate.efficiency_distinct, 1.0);
  EXPECT_GT(found.certificate.efficiency_repeats, 0.96);
  EXPECT_FALSE(found.certificate.proven_optimal);
}

}  // namespace
}  // namespace symkin::testing
