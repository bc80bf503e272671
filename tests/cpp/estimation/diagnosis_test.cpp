// SPDX-License-Identifier: MIT
#include "symkin/estimation/diagnosis.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "support/mechanisms.hpp"
#include "symkin/estimation/identification.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/statistics/distributions.hpp"

namespace symkin {
namespace {

constexpr double kAlarm = 5e-4;

struct Robot {
  Mechanism actual;
  MeasurementSet measured;
};

Robot robot(std::uint64_t seed, const MeasurementNoise& noise = {}) {
  const Mechanism nominal = testing::paper_3rrr();
  const PoseSet poses{-1, sample_workspace(nominal, testing::paper_workspace(), 70, 11).poses, 60};
  Mechanism actual = disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, seed);
  MeasurementSet measured = simulate(actual, nominal, {poses}, noise, seed).measurements;
  return {std::move(actual), std::move(measured)};
}

Diagnosis diagnosed(const MeasurementSet& measured, Estimator estimator = Estimator::joint) {
  IdentificationOptions options;
  options.estimator = estimator;
  const Mechanism nominal = testing::paper_3rrr();
  const Identification found = identify(nominal, measured, options);
  return diagnose(nominal.with_parameters(found.parameters), measured, options.noise, {}, true,
                  kAlarm);
}

double least_p(const Diagnosis& diagnosis, Suspect suspect, Index leg = -2) {
  double least = 1;
  for (const ResidualTest& test : diagnosis.tests) {
    if (test.suspect == suspect && (leg == -2 || test.leg == leg)) {
      least = std::min(least, test.p_value);
    }
  }
  return least;
}

TEST(Statistics, TailsAndLimitsAreThoseOfTables) {
  EXPECT_NEAR(chi_square_limit(10, 1e-3), 29.588, 1e-3);
  EXPECT_NEAR(chi_square_limit(10, 1 - 1e-3), 1.479, 1e-3);
  EXPECT_NEAR(f_tail(3.32, 3, 188), 0.0210, 2e-4);
  EXPECT_NEAR(normal_tails(1.959964), 0.05, 1e-6);
  EXPECT_NEAR(student_tails(2.228139, 10), 0.05, 1e-6);
  EXPECT_EQ(f_tail(5, 2, 0), 1);
}

TEST(Diagnosis, OfSoundRobotsEveryTestRejectsAsOftenAsItSays) {
  constexpr int kRobots = 150;
  std::map<Suspect, int> rejected;
  std::map<Suspect, int> made;
  for (int seed = 0; seed < kRobots; ++seed) {
    const Diagnosis diagnosis = diagnosed(robot(static_cast<std::uint64_t>(seed)).measured);
    for (const ResidualTest& test : diagnosis.tests) {
      ++made[test.suspect];
      rejected[test.suspect] += test.p_value < 0.05 ? 1 : 0;
    }
  }
  ASSERT_EQ(made.size(), 6U);
  for (const auto& [suspect, count] : made) {
    const double share = static_cast<double>(rejected[suspect]) / count;
    // Four standard errors of the rarest test, one a robot.
    EXPECT_NEAR(share, 0.05, 4 * std::sqrt(0.05 * 0.95 / kRobots)) << static_cast<int>(suspect);
  }
}

TEST(Diagnosis, DoesNotDependOnTheEstimatorThatItJudges) {
  const Robot made = robot(1);
  const Diagnosis joint = diagnosed(made.measured);
  for (const Estimator estimator : {Estimator::paper, Estimator::implicit}) {
    const Diagnosis other = diagnosed(made.measured, estimator);
    ASSERT_EQ(other.tests.size(), joint.tests.size());
    for (std::size_t i = 0; i < joint.tests.size(); ++i) {
      EXPECT_NEAR(other.tests[i].statistic, joint.tests[i].statistic,
                  0.02 * (1 + std::abs(joint.tests[i].statistic)));
    }
    EXPECT_LT((other.student - joint.student).cwiseAbs().maxCoeff(), 0.05);
  }
}

TEST(Diagnosis, NamesTheLegWhoseSensorIsCurved) {
  Robot made = robot(2);
  made.measured.readings.col(1).array() += 1e-2 * made.measured.readings.col(1).array().square();
  const Diagnosis diagnosis = diagnosed(made.measured);
  EXPECT_LT(least_p(diagnosis, Suspect::sensor_curvature, 1), 1e-6);
  EXPECT_GT(least_p(diagnosis, Suspect::sensor_curvature, 0), 1e-3);
  EXPECT_GT(least_p(diagnosis, Suspect::sensor_curvature, 2), 1e-3);
}

TEST(Diagnosis, SeesADriftInTheOrderOfMeasuring) {
  Robot made = robot(3);
  for (Index i = 0; i < made.measured.poses.rows(); ++i) {
    made.measured.poses(i, 0) += 3e-4 * std::sin(0.2 * static_cast<double>(i));
  }
  EXPECT_LT(least_p(diagnosed(made.measured), Suspect::order), 1e-6);
}

TEST(Diagnosis, SeesWhatTheGeometryDoesNotHave) {
  Robot made = robot(4);
  made.measured.readings.col(2).array() += 2e-3 * made.measured.poses.col(0).array().square();
  EXPECT_LT(least_p(diagnosed(made.measured), Suspect::geometry, 2), 1e-6);
}

TEST(Diagnosis, SeesThatTheEstimatorsDisagreeWhereTheModelLacksATerm) {
  Robot made = robot(5);
  made.measured.readings.array() += 1e-2 * made.measured.readings.array().cube();
  EXPECT_LT(least_p(diagnosed(made.measured), Suspect::estimators), 1e-4);
}

TEST(Diagnosis, NamesTheRowAndTheLegOfABlunderWhateverTheNoiseIs) {
  for (const double noise : {1e-5, 1e-4, 1e-3}) {  // 1e-4 is declared
    Robot made = robot(6, {noise, noise, 0});
    made.measured.readings(17, 1) += 100 * noise;
    const Diagnosis diagnosis = diagnosed(made.measured);
    Index row = 0;
    Index leg = 0;
    diagnosis.student.cwiseAbs().maxCoeff(&row, &leg);
    EXPECT_EQ(row, 17);
    EXPECT_EQ(leg, 1);
    EXPECT_LT(diagnosis.student_p(17, 1), 1e-9);
    EXPECT_LT(diagnosis.pose_p[17], 1e-9);
    EXPECT_GT(diagnosis.pose_p.head(17).minCoeff(), 1e-5);
  }
}

TEST(Diagnosis, ARejectedPoseIsJudgedByWhatTheOthersPredict) {
  Robot made = robot(7);
  made.measured.readings(9, 1) += 0.01;
  const Mechanism nominal = testing::paper_3rrr();
  IdentificationOptions options;
  options.loss = loss_named("cauchy");
  const Identification found = identify(nominal, made.measured, options);
  const Mechanism estimate = nominal.with_parameters(found.parameters);
  const Diagnosis with = diagnose(estimate, made.measured, options.noise, {}, true, kAlarm);
  const Diagnosis without = diagnose(estimate, made.measured, options.noise, {9}, true, kAlarm);
  EXPECT_LT(without.pose_p[9], 1e-9);
  EXPECT_NEAR(with.student(9, 1) / without.student(9, 1), 1, 0.1);
}

TEST(Diagnosis, TestsExactDataNotAtAll) {
  const Robot made = robot(8, {1e-15, 1e-15, 0});
  EXPECT_TRUE(diagnosed(made.measured).tests.empty());
}

TEST(Diagnosis, MissingReadingsAreLeftOut) {
  Robot made = robot(9);
  for (Index i = 0; i < made.measured.poses.rows(); i += 7) {
    made.measured.readings(i, i % 3) = std::nan("");
  }
  const Diagnosis diagnosis = diagnosed(made.measured);
  EXPECT_EQ(diagnosis.degrees_of_freedom, 3 * 60 - 9 - 24);
  EXPECT_TRUE(std::isnan(diagnosis.student(0, 0)));
  EXPECT_FALSE(std::isnan(diagnosis.student(0, 1)));
}

}  // namespace
}  // namespace symkin
