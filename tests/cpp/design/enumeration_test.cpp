// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "design/small_problems.hpp"

namespace symkin::testing {
namespace {

constexpr int kProblems = 12;

TEST(Enumeration, ExchangeFindsTheBestDeterminantOfSmallProblems) {
  for (std::uint64_t seed = 1; seed <= kProblems; ++seed) {
    const RowMatrix rows = random_rows(16, 3, seed);
    const Best best = enumerate(rows, 1, 6, log_det);
    const Selection found =
        select_poses(CandidateRows{rows}, options_for(6, SelectionMethod::exchange));
    EXPECT_EQ(found.indices, best.chosen) << "seed " << seed;
    EXPECT_NEAR(found.log_det, best.value, 1e-10);
  }
}

TEST(Enumeration, ExchangeFindsTheBestDeterminantOfCandidatesWithThreeRows) {
  for (std::uint64_t seed = 1; seed <= kProblems; ++seed) {
    const RowMatrix rows = random_rows(3 * 14, 5, seed);
    const Best best = enumerate(rows, 3, 4, log_det);
    const Selection found =
        select_poses(CandidateRows{rows, 3}, options_for(4, SelectionMethod::exchange));
    EXPECT_EQ(found.indices, best.chosen) << "seed " << seed;
    EXPECT_NEAR(found.log_det, best.value, 1e-10);
  }
}

TEST(Enumeration, AsManyPosesAsParametersAreFound) {
  for (std::uint64_t seed = 1; seed <= kProblems; ++seed) {
    const RowMatrix rows = random_rows(14, 4, seed);
    const Best best = enumerate(rows, 1, 4, log_det);
    const Selection found =
        select_poses(CandidateRows{rows}, options_for(4, SelectionMethod::exchange));
    EXPECT_NEAR(found.log_det, best.value, 1e-8) << "seed " << seed;
  }
}

TEST(Enumeration, BranchAndBoundProvesWhatEnumerationFinds) {
  for (std::uint64_t seed = 1; seed <= kProblems; ++seed) {
    for (const Index r : {Index{1}, Index{2}}) {
      const RowMatrix rows = random_rows(r * 16, 3, seed);
      const Best best = enumerate(rows, r, 5, log_det);
      const Selection found =
          select_poses(CandidateRows{rows, r}, options_for(5, SelectionMethod::exhaustive));
      EXPECT_TRUE(found.certificate.proven_optimal) << "seed " << seed;
      EXPECT_NEAR(found.log_det, best.value, 1e-9) << "seed " << seed;
      EXPECT_GE(found.certificate.log_det_bound_distinct, best.value);
      EXPECT_GT(found.certificate.efficiency_distinct, 1 - 1e-7);
    }
  }
}

// A proof must not depend on a lucky start: without kicks and from a poor start the branch and
// bound has to find the optimum itself.
TEST(Enumeration, BranchAndBoundDoesNotRelyOnTheExchange) {
  for (std::uint64_t seed = 1; seed <= kProblems; ++seed) {
    const RowMatrix rows = random_rows(18, 4, seed);
    const Best best = enumerate(rows, 1, 4, log_det);
    SelectionOptions options = options_for(4, SelectionMethod::exhaustive);
    options.kicks = 0;
    const Selection found = select_poses(CandidateRows{rows}, options);
    EXPECT_TRUE(found.certificate.proven_optimal) << "seed " << seed;
    EXPECT_NEAR(found.log_det, best.value, 1e-9) << "seed " << seed;
  }
}

TEST(Enumeration, ExpectedErrorExchangeFindsTheLeastTrace) {
  for (std::uint64_t seed = 1; seed <= kProblems; ++seed) {
    for (const Index r : {Index{1}, Index{2}}) {
      const RowMatrix rows = random_rows(r * 15, 4, seed);
      const RowMatrix root = random_rows(3, 4, seed + 100);
      SelectionOptions options = options_for(5, SelectionMethod::exchange);
      options.criterion = Criterion::expected_error;
      options.error_weight = root.transpose() * root;
      const Best best = enumerate(rows, r, 5, [&](const RowMatrix& m) {
        return -(m.inverse() * options.error_weight).trace();
      });
      const Selection found = select_poses(CandidateRows{rows, r}, options);
      EXPECT_NEAR(found.criterion_value, -best.value, 1e-9 * -best.value) << "seed " << seed;
      EXPECT_LE(found.certificate.criterion_bound, -best.value);
      EXPECT_GT(found.certificate.criterion_efficiency, 0.5);
    }
  }
}

class OtherCriteria : public ::testing::TestWithParam<Criterion> {};

TEST_P(OtherCriteria, ExchangeFindsTheBestOfSmallProblems) {
  int found_best = 0;
  for (std::uint64_t seed = 1; seed <= kProblems; ++seed) {
    const RowMatrix rows = random_rows(14, 3, seed);
    SelectionOptions options = options_for(5, SelectionMethod::exchange);
    options.criterion = GetParam();
    options.column_scale = Vector::LinSpaced(3, 0.5, 2);
    options.prior = static_cast<double>(seed % 3) * RowMatrix::Identity(3, 3);
    const Best best = enumerate(rows, 1, 5, [&](const RowMatrix& m) {
      const RowMatrix scaled = options.column_scale.asDiagonal() * (m + options.prior) *
                               options.column_scale.asDiagonal();
      const Vector s = Eigen::SelfAdjointEigenSolver<RowMatrix>(scaled).eigenvalues().cwiseSqrt();
      switch (GetParam()) {
        case Criterion::O2:
          return s[0] / s[2];
        case Criterion::O3:
          return s[0];
        case Criterion::O4:
          return s[0] * s[0] / s[2];
        default:
          return 1 / s.cwiseInverse().sum();
      }
    });
    const Selection found = select_poses(CandidateRows{rows}, options);
    EXPECT_LE(found.criterion_value, best.value * (1 + 1e-12)) << "seed " << seed;
    EXPECT_GE(found.certificate.criterion_bound, best.value) << "seed " << seed;
    found_best += found.criterion_value > best.value * (1 - 1e-9) ? 1 : 0;
  }
  EXPECT_EQ(found_best, kProblems);
}

INSTANTIATE_TEST_SUITE_P(Enumeration, OtherCriteria,
                         ::testing::Values(Criterion::O2, Criterion::O3, Criterion::O4,
                                           Criterion::O5));

TEST(Enumeration, PosesKeepTheirDistanceAndRequiredOnesStay) {
  for (std::uint64_t seed = 1; seed <= kProblems; ++seed) {
    const RowMatrix rows = random_rows(16, 3, seed);
    SelectionOptions options = options_for(5, SelectionMethod::exchange);
    options.coordinates = random_rows(16, 2, seed + 200);
    options.minimum_distance = 0.6;
    options.required = {3};
    options.forbidden.assign(16, false);
    options.forbidden[7] = true;
    const Best best = enumerate(rows, 1, 5, log_det, [&](const std::vector<Index>& chosen) {
      bool required = false;
      for (const Index a : chosen) {
        required = required || a == 3;
        if (a == 7) {
          return false;
        }
        for (const Index b : chosen) {
          if (a < b && (options.coordinates.row(a) - options.coordinates.row(b)).norm() < 0.6) {
            return false;
          }
        }
      }
      return required;
    });
    const Selection found = select_poses(CandidateRows{rows}, options);
    EXPECT_NEAR(found.log_det, best.value, 1e-10) << "seed " << seed;
    EXPECT_GE(found.certificate.log_det_bound_distinct, best.value);
  }
}

TEST(Enumeration, APriorIsAugmentedByTheBestPoses) {
  for (std::uint64_t seed = 1; seed <= kProblems; ++seed) {
    const RowMatrix rows = random_rows(16, 4, seed);
    const RowMatrix measured = random_rows(3, 4, seed + 300);
    SelectionOptions options = options_for(3, SelectionMethod::exchange);
    options.prior = measured.transpose() * measured;
    const Best best =
        enumerate(rows, 1, 3, [&](const RowMatrix& m) { return log_det(m + options.prior); });
    const Selection found = select_poses(CandidateRows{rows}, options);
    EXPECT_NEAR(found.log_det, best.value, 1e-9) << "seed " << seed;
    EXPECT_GE(found.certificate.log_det_bound_distinct, best.value);
  }
}

}  // namespace
}  // namespace symkin::testing
