// SPDX-License-Identifier: MIT
#include <ceres/loss_function.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <boost/math/distributions/students_t.hpp>

#include "estimation/welsch_loss.hpp"
#include "support/mechanisms.hpp"
#include "symkin/estimation/fleet.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr MeasurementNoise kNoise{1e-4, 1e-4, 0};

struct Robot {
  Mechanism actual;
  MeasurementSet measured;
};

// 3-RRRs at the same poses, `gross` of which have a coordinate off by so many metres.
std::vector<Robot> robots(int robots, Index poses, Index gross, double off) {
  const Mechanism nominal = testing::paper_3rrr();
  const RowMatrix sampled =
      sample_workspace(nominal, testing::paper_workspace(), poses + 10, 11).poses;
  std::vector<Robot> made;
  for (int i = 0; i < robots; ++i) {
    const auto seed = static_cast<std::uint64_t>(i);
    Mechanism actual = disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, seed);
    MeasurementSet measured =
        simulate(actual, nominal, {{-1, sampled, poses}}, kNoise, seed).measurements;
    for (Index k = 0; k < gross; ++k) {
      measured.poses((3 + 7 * k + i) % poses, k % 2) += (i + k) % 2 == 0 ? off : -off;
    }
    made.push_back({std::move(actual), std::move(measured)});
  }
  return made;
}

IdentificationOptions with(Estimator estimator, const std::string& loss) {
  IdentificationOptions options;
  options.estimator = estimator;
  options.noise = kNoise;
  options.loss = loss_named(loss);
  return options;
}

TEST(RobustIdentification, EndsWhereWeightsAndScaleWentRoundForEver) {
  const Mechanism nominal = testing::paper_3rrr();
  for (const Robot& robot : robots(40, 60, 3, 2e-3)) {
    for (const char* loss : {"huber", "cauchy", "tukey"}) {
      const Identification found = identify(nominal, robot.measured, with(Estimator::joint, loss));
      ASSERT_TRUE(found.converged) << loss << ": " << found.legs[0].failure;
    }
  }
}

TEST(RobustIdentification, EndsOrRefusesWithOnePoseOffOfAFew) {
  const Mechanism nominal = testing::paper_3rrr();
  int refused = 0;
  int ended = 0;
  for (const Index poses : {Index{12}, Index{30}, Index{60}}) {
    for (const Robot& robot : robots(20, poses, 1, 5e-3)) {
      for (const Estimator estimator : {Estimator::implicit, Estimator::inverse}) {
        for (const char* loss : {"cauchy", "tukey"}) {
          try {
            const Identification found = identify(nominal, robot.measured, with(estimator, loss));
            EXPECT_TRUE(found.converged) << loss << ": " << found.legs[0].failure;
            ++ended;
          } catch (const InvalidInput& error) {
            EXPECT_NE(std::string(error.what()).find("leverage"), std::string::npos);
            ++refused;
          }
        }
      }
    }
  }
  EXPECT_GE(refused, 80);  // twelve poses are too few for eight parameters
  EXPECT_GE(ended, 80);
}

TEST(RobustIdentification, ChiSquareOfSoundDataIsOneADegree) {
  const Mechanism nominal = testing::paper_3rrr();
  for (const char* loss : {"huber", "cauchy", "tukey"}) {
    for (const Estimator estimator : {Estimator::implicit, Estimator::inverse, Estimator::joint}) {
      double sum = 0;
      double count = 0;
      Index beyond = 0;
      for (const Robot& robot : robots(40, 60, 0, 0)) {
        const Identification found = identify(nominal, robot.measured, with(estimator, loss));
        for (const GoodnessOfFit& fit : found.goodness) {
          sum += fit.chi_square / fit.degrees_of_freedom;
          ++count;
          beyond += fit.chi_square > fit.limit || fit.chi_square < fit.least ? 1 : 0;
        }
      }
      // Each with a deviation of about 0.21 (0.11 for all legs): four standard errors are 0.08.
      EXPECT_NEAR(sum / count, 1, 0.08) << loss << ", " << static_cast<int>(estimator);
      EXPECT_LE(beyond, 2) << loss << ", " << static_cast<int>(estimator);
    }
  }
}

TEST(RobustIdentification, RejectedPosesDoNotCountForChiSquare) {
  const Mechanism nominal = testing::paper_3rrr();
  for (const Estimator estimator : {Estimator::implicit, Estimator::inverse, Estimator::joint}) {
    const IdentificationOptions options = with(estimator, "tukey");
    const Identification sound = identify(nominal, robots(1, 60, 0, 0)[0].measured, options);
    const Identification spoilt = identify(nominal, robots(1, 60, 3, 0.01)[0].measured, options);
    for (std::size_t i = 0; i < sound.goodness.size(); ++i) {
      EXPECT_FALSE(spoilt.goodness[i].unexplained());
      // Three poses less of 60.
      const double less =
          sound.goodness[i].degrees_of_freedom - spoilt.goodness[i].degrees_of_freedom;
      EXPECT_GT(less, estimator == Estimator::joint ? 7 : 1);
      EXPECT_LT(less, estimator == Estimator::joint ? 14 : 6);
    }
  }
}

TEST(RobustIdentification, IntervalsHoldTheTruthWhetherOrNotThereAreGrossErrors) {
  const Mechanism nominal = testing::paper_3rrr();
  for (const Index gross : {Index{0}, Index{5}}) {
    const std::vector<Robot> made = robots(60, 60, gross, 2e-3);
    for (const Estimator estimator : {Estimator::implicit, Estimator::inverse, Estimator::joint}) {
      Index inside = 0;
      Index count = 0;
      for (const Robot& robot : made) {
        const Identification found = identify(nominal, robot.measured, with(estimator, "cauchy"));
        const double degrees = found.legs[0].student_degrees;
        EXPECT_EQ(degrees, estimator == Estimator::joint ? 180 - 24 : 60 - 8);
        const double limit = boost::math::quantile(boost::math::students_t(degrees), 0.975);
        const RowMatrix errors = found.parameters - robot.actual.parameters();
        const Vector z = Eigen::Map<const Vector>(errors.data(), errors.size())
                             .cwiseQuotient(found.covariance.diagonal().cwiseSqrt());
        inside += (z.array().abs() < limit).count();
        count += z.size();
      }
      // 24 correlated parameters of 60 robots: four standard errors are about 0.04.
      EXPECT_NEAR(static_cast<double>(inside) / static_cast<double>(count), 0.95, 0.04)
          << gross << ", " << static_cast<int>(estimator);
    }
  }
}

// Neighbouring legs share the errors of a pose; with a loss the covariance is still one.
TEST(RobustIdentification, CovarianceOfAllLegsIsPositiveDefinite) {
  const Robot made = robots(1, 60, 3, 2e-3)[0];
  for (const Estimator estimator : {Estimator::implicit, Estimator::inverse}) {
    const Identification found =
        identify(testing::paper_3rrr(), made.measured, with(estimator, "tukey"));
    const Vector deviations = found.covariance.diagonal().cwiseSqrt();
    const RowMatrix correlation = deviations.cwiseInverse().asDiagonal() * found.covariance *
                                  deviations.cwiseInverse().asDiagonal();
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation).eigenvalues()[0], 1e-9);
    EXPECT_GT(correlation.block(0, 8, 8, 8).norm(), 0.1);
  }
}

TEST(RobustIdentification, TakesALossOfTheUsersOwn) {
  const LossFamily welsch = testing::welsch();
  const Mechanism nominal = testing::paper_3rrr();
  const Robot made = robots(1, 60, 3, 3e-3)[0];
  for (const Estimator estimator : {Estimator::implicit, Estimator::inverse, Estimator::joint}) {
    IdentificationOptions options = with(estimator, "tukey");
    const Identification tukey = identify(nominal, made.measured, options);
    options.loss = {&welsch};
    const Identification own = identify(nominal, made.measured, options);
    ASSERT_TRUE(own.converged);
    const RowMatrix apart = own.parameters - tukey.parameters;
    EXPECT_LT(Eigen::Map<const Vector>(apart.data(), apart.size())
                  .cwiseQuotient(tukey.covariance.diagonal().cwiseSqrt())
                  .lpNorm<Eigen::Infinity>(),
              0.5);
    EXPECT_GT(apart.norm(), 0);
  }
}

TEST(RobustIdentification, OfJointBendsByTheNumberOfConditionsOfAPose) {
  const Mechanism nominal = testing::paper_3rrr();
  const Robot made = robots(1, 60, 3, 5e-4)[0];
  const auto observed = [](const RowMatrix& values, double deviation) {
    return Observed{values, RowMatrix::Constant(values.rows(), values.cols(), deviation)};
  };
  Observations observations;
  observations.poses = observed(made.measured.poses, 1e-4);
  observations.readings = observed(made.measured.readings, 0);
  observations.readings.values(7, 2) = std::numeric_limits<double>::quiet_NaN();
  const symkin::Setup setup = symkin::Setup::of(nominal);
  JointOptions options;
  options.loss = loss_named("cauchy");
  options.start = made.measured.poses;
  const JointFit fit =
      fit_jointly(nominal, setup, observations, Layout::of_all_parameters(nominal, setup), options);
  ASSERT_TRUE(fit.converged);
  EXPECT_EQ(fit.conditions[7], 2);
  for (Index pose = 0; pose < 60; ++pose) {
    const double bend =
        bend_of(*options.loss.family, fit.conditions[static_cast<std::size_t>(pose)]);
    EXPECT_NEAR(fit.loss_weights[pose], 1 / (1 + fit.chi_squares[pose] / (bend * bend)), 1e-12);
  }
}

TEST(RobustIdentification, TakesTheResidualsOwnScaleWhereTheDeclaredNoiseIsNot) {
  const Mechanism nominal = testing::paper_3rrr();
  const Robot made = robots(1, 60, 3, 3e-3)[0];
  for (const Estimator estimator : {Estimator::implicit, Estimator::joint}) {
    IdentificationOptions options = with(estimator, "cauchy");
    options.loss.spread = 0;
    const Identification right = identify(nominal, made.measured, options);
    options.noise = {1e-5, 1e-5, 0};
    const Identification wrong = identify(nominal, made.measured, options);
    ASSERT_TRUE(wrong.converged);
    const Vector deviations = right.covariance.diagonal().cwiseSqrt();
    const RowMatrix apart = wrong.parameters - right.parameters;
    EXPECT_LT(Eigen::Map<const Vector>(apart.data(), apart.size())
                  .cwiseQuotient(deviations)
                  .lpNorm<Eigen::Infinity>(),
              1e-4);
    EXPECT_LT((wrong.covariance.diagonal().cwiseSqrt().cwiseQuotient(deviations).array() - 1)
                  .abs()
                  .maxCoeff(),
              1e-4);
  }
}

TEST(Identification, CountsClosuresLessParametersAsDegreesOfFreedom) {
  const Robot made = robots(1, 40, 0, 0)[0];
  for (const Estimator estimator : {Estimator::paper, Estimator::inverse, Estimator::implicit}) {
    for (const GoodnessOfFit& fit :
         identify(testing::paper_3rrr(), made.measured, with(estimator, "none")).goodness) {
      EXPECT_EQ(fit.degrees_of_freedom, 40 - 8);
    }
  }
}

TEST(Identification, ScalesTheCovarianceOfJointByWhatTheNoiseLeavesUnexplained) {
  const Robot made = robots(1, 40, 0, 0)[0];
  IdentificationOptions options = with(Estimator::joint, "none");
  options.noise = {1e-5, 1e-5, 0};
  const Identification found = identify(testing::paper_3rrr(), made.measured, options);
  ASSERT_TRUE(found.goodness[0].unexplained());
  const double spread = found.goodness[0].spread();
  EXPECT_NEAR(spread * spread, found.goodness[0].chi_square / (120 - 24), 1e-9);
  // Ten times the noise gives ten times the deviations, unless they follow the residuals.
  options.noise = kNoise;
  const Identification right = identify(testing::paper_3rrr(), made.measured, options);
  ASSERT_FALSE(right.goodness[0].unexplained());
  const Vector ratio =
      found.covariance.diagonal().cwiseQuotient(right.covariance.diagonal()).cwiseSqrt();
  EXPECT_LT((ratio.array() / (spread / 10) - 1).abs().maxCoeff(), 1e-3);
}

// Where the noise explains nothing the covariance is the jackknife's: what each pose does.
TEST(Identification, TakesACovarianceFromWhatTheEstimateIsWithoutEachPose) {
  const Mechanism nominal = testing::paper_3rrr();
  const Robot made = robots(1, 20, 0, 0)[0];
  IdentificationOptions options = with(Estimator::implicit, "none");
  options.noise = {1e-6, 1e-6, 0};
  const Identification found = identify(nominal, made.measured, options);
  ASSERT_TRUE(found.goodness[0].unexplained());
  RowMatrix jackknife = RowMatrix::Zero(24, 24);
  for (Index out = 0; out < 20; ++out) {
    MeasurementSet rest = made.measured;
    std::vector<Index> kept;
    for (Index row = 0; row < 20; ++row) {
      if (row != out) {
        kept.push_back(row);
      }
    }
    rest.poses = RowMatrix(made.measured.poses(kept, Eigen::all));
    rest.readings = RowMatrix(made.measured.readings(kept, Eigen::all));
    rest.leg_sets.pop_back();
    const RowMatrix change = identify(nominal, rest, options).parameters - found.parameters;
    const Eigen::Map<const Vector> all(change.data(), 24);
    jackknife += all * all.transpose();
  }
  const Vector ratio = found.covariance.diagonal().cwiseQuotient(jackknife.diagonal()).cwiseSqrt();
  EXPECT_NEAR(ratio.minCoeff(), 1, 0.02);
  EXPECT_NEAR(ratio.maxCoeff(), 1, 0.02);
}

}  // namespace
}  // namespace symkin
