// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/projection.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <utility>

#include "support/mechanisms.hpp"
#include "symkin/estimation/detail/missing_terms.hpp"
#include "symkin/estimation/simulation.hpp"

namespace symkin {
namespace {

// A small robot's closures with a pose left out and readings that were not taken, and the same by
// matrices as large as the system.
struct Small {
  Small()
      : nominal(testing::paper_3rrr()),
        system(whitened(nominal)),
        left_out(system.poses.size(), false) {
    left_out[3] = true;
    RowMatrix jacobian = system.jacobian;
    residual = system.residual;
    kept.setOnes(residual.size());
    kept.segment(system.poses[3].first, system.poses[3].count()).setZero();
    jacobian = kept.asDiagonal() * jacobian;
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(jacobian);
    const Eigen::MatrixXd q =
        qr.householderQ() * Eigen::MatrixXd::Identity(jacobian.rows(), jacobian.cols());
    away = Eigen::MatrixXd(kept.asDiagonal()) - q * q.transpose();
    residual = away * residual;
  }

  static WhitenedClosures whitened(const Mechanism& nominal) {
    const RowMatrix poses = sample_workspace(nominal, testing::paper_workspace(), 40, 11).poses;
    const Mechanism actual = disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, 2);
    MeasurementSet measured = simulate(actual, nominal, {{-1, poses, 30}}, {}, 2).measurements;
    for (Index i = 0; i < 30; i += 7) {
      measured.readings(i, i % 3) = std::nan("");
    }
    return whiten_closures(actual, measured, all_legs(3), {}, LinearisedAt::measured);
  }

  // Rows of two legs at the poses that count, both read; or of one leg after another.
  std::vector<std::pair<Index, Index>> pairs_of_legs(Index a, Index b) const {
    std::vector<std::pair<Index, Index>> pairs;
    for (const WhitenedPose& pose : system.poses) {
      Index of_a = -1, of_b = -1;
      for (Index i = 0; i < pose.count(); ++i) {
        const Index leg = pose.legs[static_cast<std::size_t>(i)];
        of_a = leg == a ? pose.first + i : of_a;
        of_b = leg == b ? pose.first + i : of_b;
      }
      if (of_a >= 0 && of_b >= 0 && kept[of_a] > 0) {
        pairs.emplace_back(of_a, of_b);
      }
    }
    return pairs;
  }

  std::vector<std::pair<Index, Index>> pairs_of_neighbours() const {
    std::vector<std::pair<Index, Index>> pairs;
    Index last[3] = {-1, -1, -1};
    for (const WhitenedPose& pose : system.poses) {
      for (Index i = 0; i < pose.count() && kept[pose.first] > 0; ++i) {
        Index& before = last[pose.legs[static_cast<std::size_t>(i)]];
        if (before >= 0) {
          pairs.emplace_back(before, pose.first + i);
        }
        before = pose.first + i;
      }
    }
    return pairs;
  }

  double deviations_of(const std::vector<std::pair<Index, Index>>& pairs) const {
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(residual.size(), residual.size());
    for (const auto& [a, b] : pairs) {
      m(a, b) += 0.5;
      m(b, a) += 0.5;
    }
    const Eigen::MatrixXd mr = m * away;
    const double n = away.trace();
    const double trace = mr.trace();
    const double variance = 2 * (n * (mr * mr).trace() - trace * trace) / (n * n * (n + 2));
    return (residual.dot(m * residual) / residual.squaredNorm() - trace / n) / std::sqrt(variance);
  }

  Mechanism nominal;
  WhitenedClosures system;
  std::vector<bool> left_out;
  Vector kept;
  Eigen::MatrixXd away;  // R = I - QQ'
  Vector residual;       // R r
};

struct Measured {
  Mechanism actual;
  MeasurementSet taken;
  MeasurementNoise noise{1e-4, 1e-4, 5e-5};

  static Measured some() {
    const Mechanism nominal = testing::paper_3rrr();
    const RowMatrix poses = sample_workspace(nominal, testing::paper_workspace(), 40, 11).poses;
    Measured measured{disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, 2), {}};
    measured.taken =
        simulate(measured.actual, nominal, {{-1, poses, 20}}, measured.noise, 2).measurements;
    for (Index i = 0; i < 20; i += 7) {
      measured.taken.readings(i, i % 3) = std::nan("");
    }
    return measured;
  }
  WhitenedClosures whitened(LinearisedAt where) const {
    return whiten_closures(actual, taken, all_legs(3), noise, where);
  }
};

TEST(WhitenedClosures, AreThoseOfTheLegsThatWereReadTimesTheUnitsOfTheirPose) {
  const WhitenedClosures system = Measured::some().whitened(LinearisedAt::measured);
  Index closures = 0;
  for (const WhitenedPose& pose : system.poses) {
    ASSERT_EQ(pose.first, closures);
    closures += pose.count();
    EXPECT_GT(pose.units.diagonal().minCoeff(), 0);
    Vector h(pose.count());
    RowMatrix by_parameters = RowMatrix::Zero(pose.count(), system.jacobian.cols());
    for (Index i = 0; i < pose.count(); ++i) {
      const auto leg = static_cast<std::size_t>(pose.legs[static_cast<std::size_t>(i)]);
      const ClosureRows& rows = system.of_legs[leg];
      h[i] = rows.closure[pose.row];
      by_parameters.row(i).segment(system.columns[leg], rows.by_parameters.cols()) =
          rows.by_parameters.row(pose.row);
    }
    EXPECT_LT((pose.units * h - system.residual.segment(pose.first, pose.count())).norm(), 1e-9);
    EXPECT_LT(
        (pose.units * by_parameters - system.jacobian.middleRows(pose.first, pose.count())).norm(),
        1e-9 * system.jacobian.norm());
  }
  EXPECT_EQ(closures, 3 * 20 - 3);
}

TEST(WhitenedClosures, AtTheMostLikelyPosesCloseAndHaveTheResidualsOfWhatWasMeasured) {
  const Measured measured = Measured::some();
  const WhitenedClosures at_measured = measured.whitened(LinearisedAt::measured);
  const WhitenedClosures likely = measured.whitened(LinearisedAt::likely);
  for (std::size_t leg = 0; leg < 3; ++leg) {
    EXPECT_LT(likely.of_legs[leg].closure.norm(), 1e-3 * at_measured.of_legs[leg].closure.norm());
  }
  EXPECT_LT((likely.residual - at_measured.residual).norm(), 1e-2 * at_measured.residual.norm());
  for (Index i = 0; i < 20; ++i) {
    for (Index leg = 0; leg < 3; ++leg) {
      const double moved = std::abs(likely.at.readings(i, leg) - measured.taken.readings(i, leg));
      EXPECT_TRUE(std::isnan(moved) || (moved > 0 && moved < 5 * measured.noise.reading));
    }
  }
}

TEST(Projection, ByLegsIsTheDenseOne) {
  const Small small;
  const Projection projection(small.system, small.left_out);
  EXPECT_LT((projection.residual() - small.residual).norm(), 1e-12 * small.residual.norm());
  EXPECT_EQ(projection.degrees_of_freedom(), std::lround(small.away.trace()));
  for (Index a = 0; a < 3; ++a) {
    for (Index b = a + 1; b < 3; ++b) {
      EXPECT_NEAR(projection.legs_together(a, b).value(),
                  small.deviations_of(small.pairs_of_legs(a, b)), 1e-12);
    }
  }
  EXPECT_NEAR(projection.neighbours().value(), small.deviations_of(small.pairs_of_neighbours()),
              1e-12);
}

TEST(Projection, PredictsAPoseAsTheOthersWould) {
  const Small small;
  const Projection projection(small.system, small.left_out);
  for (const Index k : {Index{3}, Index{8}}) {
    std::vector<bool> without = small.left_out;
    without[static_cast<std::size_t>(k)] = true;
    const Projection::Prediction of_others = Projection(small.system, without).predicted(k);
    const Projection::Prediction predicted = projection.predicted(k);
    EXPECT_EQ(predicted.rank, of_others.rank);
    EXPECT_NEAR(predicted.square, of_others.square, 1e-9 * of_others.square);
    EXPECT_LT((predicted.inverse - of_others.inverse).norm(), 1e-9);
    EXPECT_LT((predicted.standardised - of_others.standardised).norm(), 1e-9);
  }
}

TEST(MissingTerms, ExplainWhatTheDenseProjectionOfThemDoes) {
  const Small small;
  const WhitenedClosures& system = small.system;
  const Projection projection(system, small.left_out);
  std::vector<RowMatrix> terms;
  Eigen::MatrixXd whitened = Eigen::MatrixXd::Zero(small.residual.size(), 6);
  for (Index leg = 0; leg < 3; ++leg) {
    const Vector& by_reading = system.of_legs[static_cast<std::size_t>(leg)].by_reading;
    RowMatrix& own = terms.emplace_back(by_reading.size(), 2);
    for (Index i = 0; i < own.rows(); ++i) {
      own.row(i) << by_reading[i] * std::sin(0.7 * static_cast<double>(i)), std::cos(i * i);
    }
  }
  for (const WhitenedPose& pose : system.poses) {
    for (Index i = 0; i < pose.count(); ++i) {
      const Index leg = pose.legs[static_cast<std::size_t>(i)];
      const Vector unit = pose.units.col(i) * small.kept[pose.first];
      whitened.block(pose.first, 2 * leg, pose.count(), 2) +=
          unit * terms[static_cast<std::size_t>(leg)].row(pose.row);
    }
  }
  const MissingTerms missing(system, projection, terms);
  const auto square_of = [&](const std::vector<Index>& columns) {
    const Eigen::MatrixXd unexplained = small.away * whitened(kAll, columns);
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(unexplained);
    const Eigen::MatrixXd basis =
        qr.householderQ() * Eigen::MatrixXd::Identity(unexplained.rows(), unexplained.cols());
    return (basis.transpose() * small.residual).squaredNorm();
  };
  const MissingTerms::Explained of_second = missing.explained({1});
  EXPECT_EQ(of_second.rank, 2);
  EXPECT_NEAR(of_second.square, square_of({2, 3}), 1e-12);
  EXPECT_NEAR(of_second.alone[1], square_of({3}), 1e-12);
  EXPECT_NEAR(missing.explained({0, 2}).square, square_of({0, 1, 4, 5}), 1e-12);
}

}  // namespace
}  // namespace symkin
