// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "design/small_problems.hpp"
#include "support/paper_leg.hpp"

namespace symkin::testing {
namespace {

RowMatrix paper_candidates() { return paper_rows(paper_poses(3000)); }

// Rows that are made when asked for.
class GeneratedRows final : public RowSource {
 public:
  explicit GeneratedRows(RowMatrix poses) : poses_(std::move(poses)) {}
  Index size() const override { return poses_.rows(); }
  Index rows_per_pose() const override { return 1; }
  Index parameters() const override { return PaperLeg::kParameters; }
  void fill(Index first, Index count, double* rows) const override {
    for (Index i = 0; i < count; ++i) {
      PaperLeg().row(poses_.row(first + i).data(), rows + i * parameters());
    }
  }

 private:
  RowMatrix poses_;
};

TEST(Methods, ActiveCalibrationIsGoodAndTheExchangeIsNoWorse) {
  const RowMatrix rows = paper_candidates();
  const auto log_det_by = [&](SelectionMethod method) {
    return select_poses(CandidateRows{rows}, options_for(24, method)).log_det;
  };
  const double exchange = log_det_by(SelectionMethod::exchange);
  const double active = log_det_by(SelectionMethod::sun_hollerbach);
  const double drawn = log_det_by(SelectionMethod::random);
  EXPECT_LE(active, exchange + 1e-9);
  EXPECT_GT(active, exchange - 0.1);
  EXPECT_GT(active, drawn + 1);
}

TEST(Methods, ActiveCalibrationEndsWhereNoAddAndDropHelps) {
  const RowMatrix rows = random_rows(60, 4, 1);
  SelectionOptions options = options_for(9, SelectionMethod::sun_hollerbach);
  options.restarts = 1;
  const std::vector<Index> chosen = select_poses(CandidateRows{rows}, options).indices;
  const RowMatrix m = information(rows, 1, chosen);
  const RowMatrix inverse = m.inverse();
  Index best = -1;
  double most = 0;
  for (Index j = 0; j < 60; ++j) {
    const double d = rows.row(j) * inverse * rows.row(j).transpose();
    if (d > most && std::find(chosen.begin(), chosen.end(), j) == chosen.end()) {
      most = d;
      best = j;
    }
  }
  const RowMatrix added = m + rows.row(best).transpose() * rows.row(best);
  for (const Index j : chosen) {
    EXPECT_LE(log_det(added - rows.row(j).transpose() * rows.row(j)), log_det(m) + 1e-9);
  }
}

// Poses of many rows add to the determinant otherwise than their variances say, by which most
// candidates are left out before.
TEST(Methods, NoExchangeWithAnyCandidateIsAnImprovement) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const RowMatrix rows = random_rows(4 * 1500, 6, seed);
    SelectionOptions options = options_for(2, SelectionMethod::exchange);
    options.kicks = 0;
    const Selection found = select_poses(CandidateRows{rows, 4}, options);
    for (const Index kept : found.indices) {
      for (Index j = 0; j < 1500; ++j) {
        EXPECT_TRUE(j == kept || log_det(information(rows, 4, {kept, j})) <= found.log_det + 1e-8)
            << "seed " << seed << ", candidate " << j;
      }
    }
  }
}

TEST(Methods, TheReportedDeterminantIsThatOfTheIndices) {
  const RowMatrix rows = paper_candidates();
  for (const SelectionMethod method : {SelectionMethod::exchange, SelectionMethod::sun_hollerbach,
                                       SelectionMethod::random, SelectionMethod::all}) {
    const Selection found = select_poses(CandidateRows{rows}, options_for(24, method));
    EXPECT_NEAR(found.log_det, log_det(information(rows, 1, found.indices)), 1e-7);
    EXPECT_NEAR(found.criterion_value, std::exp(found.log_det / 16) / 8, 1e-9);
    EXPECT_EQ(found.indices.size(), method == SelectionMethod::all ? 3000 : 24);
    EXPECT_EQ(std::set<Index>(found.indices.begin(), found.indices.end()).size(),
              found.indices.size());
    EXPECT_TRUE(std::is_sorted(found.indices.begin(), found.indices.end()));
  }
}

TEST(Methods, ScalingTheParametersDoesNotChangeTheSelection) {
  const RowMatrix rows = paper_candidates();
  const Vector scale = (Vector(8) << 1e-3, 1, 1e3, 2, 1e4, 1e-5, 7, 0.3).finished();
  const RowMatrix scaled = rows * scale.asDiagonal();
  const SelectionOptions options = options_for(24, SelectionMethod::exchange);
  const Selection one = select_poses(CandidateRows{rows}, options);
  const Selection other = select_poses(CandidateRows{scaled}, options);
  EXPECT_EQ(one.indices, other.indices);
  EXPECT_NEAR(one.certificate.efficiency_distinct, other.certificate.efficiency_distinct, 1e-4);
}

TEST(Methods, EverySeedFindsTheSameBestSetForThePaperLeg) {
  const RowMatrix rows = paper_candidates();
  SelectionOptions options = options_for(24, SelectionMethod::exchange);
  const double first = select_poses(CandidateRows{rows}, options).log_det;
  for (options.seed = 2; options.seed <= 20; ++options.seed) {
    EXPECT_NEAR(select_poses(CandidateRows{rows}, options).log_det, first, 1e-9);
  }
}

TEST(Methods, TheNumberOfThreadsDoesNotChangeAnything) {
  // Enough values for several threads.
  const RowMatrix rows = paper_rows(paper_poses(200'000));
  SelectionOptions options = options_for(24, SelectionMethod::exchange);
  options.threads = 1;
  options.spare_count = 5;
  const Selection one = select_poses(CandidateRows{rows}, options);
  for (options.threads = 2; options.threads <= 3; ++options.threads) {
    const Selection other = select_poses(CandidateRows{rows}, options);
    EXPECT_EQ(one.indices, other.indices);
    EXPECT_EQ(one.spares, other.spares);
    EXPECT_EQ(one.log_det, other.log_det);
    EXPECT_EQ(one.certificate.log_det_bound_distinct, other.certificate.log_det_bound_distinct);
    EXPECT_EQ(one.certificate.log_det_bound_repeats, other.certificate.log_det_bound_repeats);
  }
}

TEST(Methods, RowsMadeOnTheFlyGiveTheSameSelectionAsRowsInMemory) {
  const GeneratedRows generated(paper_poses(3000));
  const RowMatrix rows = paper_candidates();
  const SelectionOptions options = options_for(24, SelectionMethod::exchange);
  const Selection from_memory = select_poses(CandidateRows{rows}, options);
  const Selection on_the_fly = select_poses(generated, options);
  EXPECT_EQ(from_memory.indices, on_the_fly.indices);
  EXPECT_EQ(from_memory.log_det, on_the_fly.log_det);
}

TEST(Methods, SparesAreTheNextBestByTheirGain) {
  const RowMatrix rows = random_rows(80, 4, 1);
  SelectionOptions options = options_for(8, SelectionMethod::exchange);
  options.spare_count = 3;
  const Selection found = select_poses(CandidateRows{rows}, options);
  ASSERT_EQ(found.spares.size(), 3U);
  std::vector<Index> taken = found.indices;
  for (const Index spare : found.spares) {
    double most = -1e300;
    Index best = -1;
    for (Index j = 0; j < 80; ++j) {
      if (std::find(taken.begin(), taken.end(), j) == taken.end()) {
        std::vector<Index> with = taken;
        with.push_back(j);
        const double value = log_det(information(rows, 1, with));
        if (value > most) {
          most = value;
          best = j;
        }
      }
    }
    EXPECT_EQ(spare, best);
    taken.push_back(spare);
  }
}

TEST(Methods, IdenticalCandidatesAreDifferentPoses) {
  const RowMatrix rows = RowMatrix::Identity(2, 2).replicate(20, 1);
  const Selection found =
      select_poses(CandidateRows{rows}, options_for(6, SelectionMethod::exchange));
  EXPECT_EQ(std::set<Index>(found.indices.begin(), found.indices.end()).size(), 6U);
  EXPECT_NEAR(found.log_det, std::log(9.0), 1e-12);
  EXPECT_NEAR(found.certificate.efficiency_repeats, 1, 1e-4);
}

TEST(Methods, RequiringEveryPoseLeavesNothingToChoose) {
  const RowMatrix rows = random_rows(10, 3, 1);
  SelectionOptions options = options_for(4, SelectionMethod::exchange);
  options.required = {9, 1, 4, 2};
  const Selection found = select_poses(CandidateRows{rows}, options);
  EXPECT_EQ(found.indices, (std::vector<Index>{1, 2, 4, 9}));
  EXPECT_NEAR(found.log_det, log_det(information(rows, 1, found.indices)), 1e-10);
}

TEST(Methods, TheIndexIsThatOfColumnsInTheirScaleAndSoIsItsBound) {
  const RowMatrix rows = random_rows(40, 4, 9);
  SelectionOptions options = options_for(8, SelectionMethod::exchange);
  options.column_scale = Eigen::Vector4d(0.5, 2, 3, 7);
  const Selection scaled = select_poses(CandidateRows{rows}, options);
  // Eq. 13 of the rows with every column times its scale.
  const RowMatrix own = rows * options.column_scale.asDiagonal();
  const double det = std::exp(log_det(information(own, 1, scaled.indices)) / (2 * 4)) / 4;
  EXPECT_NEAR(scaled.criterion_value / det, 1, 1e-12);
  EXPECT_GE(scaled.certificate.criterion_bound, scaled.criterion_value);
  EXPECT_LE(scaled.certificate.criterion_bound, 1.5 * scaled.criterion_value);
}

TEST(Methods, TheEfficiencyOfAnErrorIsTheBoundOverTheError) {
  const RowMatrix rows = random_rows(30, 4, 10);
  SelectionOptions options = options_for(5, SelectionMethod::exchange);
  options.criterion = Criterion::expected_error;
  options.error_weight = RowMatrix::Identity(4, 4);
  const Selection found = select_poses(CandidateRows{rows}, options);
  const Certificate& certificate = found.certificate;
  EXPECT_LT(certificate.criterion_bound, found.criterion_value);  // the least error is not reached
  EXPECT_NEAR(certificate.criterion_efficiency, certificate.criterion_bound / found.criterion_value,
              1e-12);
}

}  // namespace
}  // namespace symkin::testing
