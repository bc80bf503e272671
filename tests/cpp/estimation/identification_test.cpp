// SPDX-License-Identifier: MIT
#include "symkin/estimation/identification.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr Estimator kEstimators[] = {Estimator::paper, Estimator::inverse, Estimator::implicit,
                                     Estimator::joint};

// Poses uniform in the workspace, all for all legs.
PoseSet random_poses(const Mechanism& mechanism, const WorkspaceOptions& workspace, Index count) {
  return {-1, sample_workspace(mechanism, workspace, count + 10, 11).poses, count};
}

struct Robot {
  Mechanism actual;
  MeasurementSet measured;
};

Robot robot(const Mechanism& nominal, const PoseSet& poses, const MeasurementNoise& noise,
            std::uint64_t seed) {
  Mechanism actual = disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, seed);
  MeasurementSet measured = simulate(actual, nominal, {poses}, noise, seed).measurements;
  return {std::move(actual), std::move(measured)};
}

TEST(Identification, EveryEstimatorFindsTheTruthFromExactMeasurements) {
  const Mechanism nominal = testing::paper_3rrr();
  const Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 60),
                           MeasurementNoise{1e-12, 1e-12, 0}, 3);
  for (const Estimator estimator : kEstimators) {
    IdentificationOptions options;
    options.estimator = estimator;
    const Identification result = identify(nominal, made.measured, options);
    EXPECT_TRUE(result.converged) << static_cast<int>(estimator);
    EXPECT_LT((result.parameters - made.actual.parameters()).cwiseAbs().maxCoeff(), 1e-8)
        << static_cast<int>(estimator);
  }
}

TEST(Identification, FindsAHexapodFromExactMeasurements) {
  const Mechanism nominal = testing::hexapod();
  const Robot made = robot(nominal, random_poses(nominal, testing::hexapod_workspace(), 60),
                           MeasurementNoise{1e-12, 1e-12, 0}, 3);
  const Identification result = identify(nominal, made.measured);
  EXPECT_TRUE(result.converged);
  EXPECT_LT((result.parameters - made.actual.parameters()).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(Identification, InverseSaysWhichPoseIsOutOfReachAtTheStart) {
  const Mechanism nominal = testing::paper_3rrr();
  Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 30),
                     MeasurementNoise{1e-12, 1e-12, 0}, 3);
  made.measured.poses.row(4).head<2>() << 30, 0;
  IdentificationOptions options;
  options.estimator = Estimator::inverse;
  ::testing::internal::CaptureStderr();
  const Identification result = identify(nominal, made.measured, options);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.legs[0].failure, "measured pose 5 is out of the leg's reach at the start");
}

TEST(Identification, StandardisedErrorsAreStandardNormalForEveryEstimator) {
  const Mechanism nominal = testing::paper_3rrr();
  const MeasurementNoise noise{1e-4, 1e-4, 2e-5};
  const PoseSet poses = random_poses(nominal, testing::paper_workspace(), 60);
  constexpr int kRobots = 60;
  for (const Estimator estimator : kEstimators) {
    double sum = 0;
    Index inside = 0;
    Index count = 0;
    for (int seed = 0; seed < kRobots; ++seed) {
      const Robot made = robot(nominal, poses, noise, static_cast<std::uint64_t>(seed));
      IdentificationOptions options;
      options.estimator = estimator;
      options.noise = noise;
      const Identification result = identify(nominal, made.measured, options);
      ASSERT_TRUE(result.converged);
      const RowMatrix errors = result.parameters - made.actual.parameters();
      const Vector z = Eigen::Map<const Vector>(errors.data(), errors.size())
                           .cwiseQuotient(result.covariance.diagonal().cwiseSqrt());
      sum += z.squaredNorm();
      inside += (z.array().abs() < 1.96).count();
      count += z.size();
    }
    // 24 correlated parameters of 60 robots: four standard errors are about 0.25 and 0.04.
    EXPECT_NEAR(sum / static_cast<double>(count), 1, 0.25) << static_cast<int>(estimator);
    EXPECT_NEAR(static_cast<double>(inside) / static_cast<double>(count), 0.95, 0.04)
        << static_cast<int>(estimator);
  }
}

TEST(Identification, ChiSquareTellsNoiseLargerThanDeclared) {
  const Mechanism nominal = testing::paper_3rrr();
  const MeasurementNoise noise{1e-4, 1e-4, 0};
  const Robot made =
      robot(nominal, random_poses(nominal, testing::paper_workspace(), 60), noise, 3);
  IdentificationOptions options;
  const Identification right = identify(nominal, made.measured, options);
  options.noise = {1e-5, 1e-5, 0};
  const Identification wrong = identify(nominal, made.measured, options);
  for (std::size_t leg = 0; leg < 3; ++leg) {
    const auto freedom = static_cast<double>(right.goodness[leg].degrees_of_freedom);
    EXPECT_NEAR(right.goodness[leg].chi_square / freedom, 1, 0.8);
    EXPECT_NEAR(wrong.goodness[leg].chi_square / right.goodness[leg].chi_square, 100, 1);
    EXPECT_FALSE(right.goodness[leg].unexplained());
    EXPECT_TRUE(wrong.goodness[leg].unexplained());
  }
  // The estimate's own uncertainty follows the residuals, not the wrong declaration.
  const Vector ratio =
      wrong.covariance.diagonal().cwiseQuotient(right.covariance.diagonal()).cwiseSqrt();
  EXPECT_GT(ratio.minCoeff(), 0.6);
  EXPECT_LT(ratio.maxCoeff(), 1.6);
}

TEST(Identification, JointComparesAllClosuresWithTheirCommonCovariance) {
  const Mechanism nominal = testing::paper_3rrr();
  const PoseSet poses = random_poses(nominal, testing::paper_workspace(), 60);
  IdentificationOptions options;
  options.estimator = Estimator::joint;
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Robot made = robot(nominal, poses, options.noise, seed);
    const Identification result = identify(nominal, made.measured, options);
    ASSERT_EQ(result.goodness.size(), 1U);
    EXPECT_EQ(result.goodness[0].degrees_of_freedom, 3 * 60 - 24);
    sum += result.goodness[0].chi_square;
  }
  // Mean of 40 values with standard deviation sqrt(2 * 156): four standard errors are 11.
  EXPECT_NEAR(sum / 40, 156, 11);
}

TEST(Identification, TheUnweightedEstimatorsAreJudgedByWhatNoEstimateCouldExplain) {
  // Their own sum of squares would be larger, since they do not minimise it.
  const Mechanism nominal = testing::paper_3rrr();
  const Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 60),
                           MeasurementNoise{1e-4, 1e-4, 0}, 5);
  IdentificationOptions options;
  const Identification whitened = identify(nominal, made.measured, options);
  options.estimator = Estimator::paper;
  const Identification paper = identify(nominal, made.measured, options);
  for (std::size_t leg = 0; leg < 3; ++leg) {
    EXPECT_NEAR(paper.goodness[leg].chi_square, whitened.goodness[leg].chi_square,
                0.01 * whitened.goodness[leg].chi_square);
    EXPECT_GT(paper.legs[leg].standardised.squaredNorm(), whitened.goodness[leg].chi_square);
  }
}

TEST(Identification, AnEstimateWithALossStaysWhereItIsWhenItIsStartedThere) {
  const Mechanism nominal = testing::paper_3rrr();
  Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 60),
                     MeasurementNoise{1e-4, 1e-4, 0}, 3);
  for (const Index row : {4, 17, 31}) {
    made.measured.poses(row, 0) += 0.002;
  }
  for (const Estimator estimator : {Estimator::inverse, Estimator::implicit, Estimator::joint}) {
    IdentificationOptions options;
    options.estimator = estimator;
    options.loss = loss_named("cauchy");
    const Identification first = identify(nominal, made.measured, options);
    ASSERT_TRUE(first.converged) << static_cast<int>(estimator);
    const Identification again =
        identify(nominal.with_parameters(first.parameters), made.measured, options);
    const RowMatrix moved = again.parameters - first.parameters;
    const Vector deviations = first.covariance.diagonal().cwiseSqrt();
    EXPECT_LT(Eigen::Map<const Vector>(moved.data(), moved.size())
                  .cwiseQuotient(deviations)
                  .lpNorm<Eigen::Infinity>(),
              1e-3)
        << static_cast<int>(estimator);
  }
}

TEST(Identification, JointRejectsPosesByItsOwnResiduals) {
  const Mechanism nominal = testing::paper_3rrr();
  Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 60),
                     MeasurementNoise{1e-4, 1e-4, 0}, 3);
  made.measured.readings(17, 1) += 0.005;  // of leg 2 alone
  IdentificationOptions options;
  options.estimator = Estimator::joint;
  options.loss = loss_named("cauchy");
  const Identification result = identify(nominal, made.measured, options);
  for (const LegIdentification& leg : result.legs) {
    EXPECT_EQ(std::count(leg.rejected.begin(), leg.rejected.end(), 17), 1);
  }
  EXPECT_FALSE(result.goodness[0].unexplained());
}

TEST(Identification, ConvergesInTheStepsOfGaussNewton) {
  const Mechanism nominal = testing::paper_3rrr();
  const Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 60),
                           MeasurementNoise{1e-4, 1e-4, 0}, 3);
  for (const LegIdentification& leg : identify(nominal, made.measured).legs) {
    EXPECT_LE(leg.iterations, 8);
  }
}

TEST(Identification, NamesWhatAConstantReadingHides) {
  const Mechanism nominal = testing::paper_3rrr();
  for (const double constant : {0.0, 0.3}) {
    Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 60),
                       MeasurementNoise{1e-4, 1e-4, 0}, 3);
    made.measured.readings.col(1).setConstant(constant);
    for (const Estimator estimator : kEstimators) {
      IdentificationOptions options;
      options.estimator = estimator;
      try {
        identify(nominal, made.measured, options);
        FAIL() << "expected a refusal";
      } catch (const NotIdentifiable& error) {
        EXPECT_NE(std::string(error.what()).find("leg 2"), std::string::npos);
        // The gain against the offset, and what a crank that stands still hides besides.
        EXPECT_EQ(error.null_directions.cols(), 3);
        EXPECT_GT(error.null_directions.row(6).norm(), 0.1);
      }
    }
  }
}

TEST(Identification, ARobustLossRejectsGrossErrors) {
  const Mechanism nominal = testing::paper_3rrr();
  Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 60),
                     MeasurementNoise{1e-4, 1e-4, 0}, 3);
  for (const Index row : {4, 17, 31}) {
    made.measured.poses(row, 0) += 0.02;
  }
  IdentificationOptions options;
  const double plain =
      (identify(nominal, made.measured, options).parameters - made.actual.parameters()).norm();
  options.loss = loss_named("tukey");
  const Identification robust = identify(nominal, made.measured, options);
  EXPECT_LT((robust.parameters - made.actual.parameters()).norm(), 0.2 * plain);
  for (const LegIdentification& leg : robust.legs) {
    for (const Index row : {4, 17, 31}) {
      EXPECT_EQ(std::count(leg.rejected.begin(), leg.rejected.end(), row), 1);
    }
    EXPECT_LT(leg.rejected.size(), 10U);
  }
}

TEST(Identification, ALegUsesItsOwnPosesOnly) {
  const Mechanism nominal = testing::paper_3rrr();
  Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 60),
                     MeasurementNoise{1e-4, 1e-4, 0}, 3);
  for (std::size_t i = 0; i < 60; ++i) {
    made.measured.leg_sets[i] = static_cast<Index>(i % 3);
  }
  IdentificationOptions options;
  options.use = PoseUse::own;
  const Identification result = identify(nominal, made.measured, options);
  EXPECT_EQ(result.legs[1].rows.size(), 20U);
  EXPECT_EQ(result.legs[1].rows[0], 1);
  // Legs that share no pose are independent.
  EXPECT_EQ(result.covariance.block(0, 8, 8, 8).norm(), 0);
  options.use = PoseUse::all;
  EXPECT_GT(identify(nominal, made.measured, options).covariance.block(0, 8, 8, 8).norm(), 0);
}

TEST(Identification, RefusesTooFewPosesAndOptionsThatContradictEachOther) {
  const Mechanism nominal = testing::paper_3rrr();
  const Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 7),
                           MeasurementNoise{1e-4, 1e-4, 0}, 3);
  EXPECT_THROW(identify(nominal, made.measured), InvalidInput);
  IdentificationOptions options;
  options.estimator = Estimator::paper;
  options.loss = loss_named("huber");
  EXPECT_THROW(identify(nominal, made.measured, options), InvalidInput);
}

TEST(Identification, SaysThatThePaperEstimatorLeftTheReachInsteadOfReturningNonsense) {
  const Mechanism nominal = testing::paper_3rrr();
  Robot made = robot(nominal, random_poses(nominal, testing::paper_workspace(), 60),
                     MeasurementNoise{1e-4, 1e-4, 0}, 3);
  made.measured.poses(0, 0) += 5;
  IdentificationOptions options;
  options.estimator = Estimator::paper;
  const Identification result = identify(nominal, made.measured, options);
  EXPECT_FALSE(result.converged);
  EXPECT_NE(result.legs[0].failure.find("out of its reach"), std::string::npos);
}

}  // namespace
}  // namespace symkin
