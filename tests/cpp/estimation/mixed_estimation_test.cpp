// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/mixed_mechanisms.hpp"
#include "symkin/chains/rrr.hpp"
#include "symkin/estimation/accuracy.hpp"
#include "symkin/estimation/diagnosis.hpp"
#include "symkin/estimation/fleet.hpp"
#include "symkin/estimation/identification.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/estimation/leg_rows.hpp"
#include "symkin/estimation/observability.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/estimation/starting_point.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/leg_model_of.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr Estimator kEstimators[] = {Estimator::paper, Estimator::inverse, Estimator::implicit,
                                     Estimator::joint};
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

struct Robot {
  Mechanism actual;
  MeasurementSet measured;
};

Robot robot(const Mechanism& nominal, const WorkspaceOptions& workspace, Index count,
            const MeasurementNoise& noise) {
  const RowMatrix poses = sample_workspace(nominal, workspace, count + 10, 11).poses;
  Mechanism actual = disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, 3);
  MeasurementSet measured = simulate(actual, nominal, {{-1, poses, count}}, noise, 3).measurements;
  return {std::move(actual), std::move(measured)};
}

Index total(const Mechanism& mechanism) { return mechanism.first_estimated(mechanism.leg_count()); }

TEST(MixedEstimation, EveryEstimatorFindsTheTruthFromExactMeasurements) {
  for (const auto& [nominal, workspace] : testing::all_mixed()) {
    const Robot made = robot(nominal, workspace, 60, {1e-12, 1e-12, 0});
    for (const Estimator estimator : kEstimators) {
      IdentificationOptions options;
      options.estimator = estimator;
      const Identification result = identify(nominal, made.measured, options);
      EXPECT_TRUE(result.converged) << nominal.name() << static_cast<int>(estimator);
      EXPECT_LT((result.parameters - made.actual.parameters()).cwiseAbs().maxCoeff(), 1e-7)
          << nominal.name() << static_cast<int>(estimator);
      const Index p = nominal.parameter_count();
      for (Index i = 0; i < nominal.leg_count() * p; ++i) {
        const auto role = nominal.model(i / p).info().parameters[static_cast<std::size_t>(i % p)];
        if (role.role.kind == ParameterKind::absent) {
          EXPECT_EQ(result.parameters(i / p, i % p), 0);
          EXPECT_TRUE(result.covariance.row(i).isZero(0));
        }
      }
    }
  }
}

// The legs of a robot of one chain that is there twice.
TEST(MixedEstimation, OfLegsThatAreAlikeIsThatOfTheirChain) {
  const Mechanism alike = testing::paper_3rrr();
  const auto other = dynamic_cast<const LegModelOf<RrrActive1>&>(*alike.chain());
  const Mechanism mixed("mixed", {alike.chain(), &other, alike.chain()}, alike.legs());
  const MeasurementNoise noise{1e-4, 1e-4, 2e-5};
  const Robot made = robot(alike, testing::paper_workspace(), 40, noise);
  EXPECT_EQ(disturb(mixed, {1e-3, 1e-3, 1e-3}, 3).parameters(), made.actual.parameters());
  for (const Estimator estimator : kEstimators) {
    IdentificationOptions options;
    options.estimator = estimator;
    options.noise = noise;
    const Identification expected = identify(alike, made.measured, options);
    const Identification result = identify(mixed, made.measured, options);
    EXPECT_LT((result.parameters - expected.parameters).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((result.covariance - expected.covariance).norm(), 1e-12 * expected.covariance.norm());
    const Mechanism found = mixed.with_parameters(result.parameters);
    const Diagnosis judged = diagnose(found, made.measured, noise, {}, true, 0.01);
    const Diagnosis judged_alike =
        diagnose(alike.with_parameters(expected.parameters), made.measured, noise, {}, true, 0.01);
    ASSERT_EQ(judged.tests.size(), judged_alike.tests.size());
    for (std::size_t i = 0; i < judged.tests.size(); ++i) {
      EXPECT_NEAR(judged.tests[i].p_value, judged_alike.tests[i].p_value, 1e-9);
    }
  }
}

TEST(MixedEstimation, TheCovarianceSaysHowFarNoiseMovesTheEstimate) {
  const auto [nominal, workspace] = testing::cranks_and_slider();
  const MeasurementNoise noise{1e-4, 1e-4, 2e-5};
  const RowMatrix poses = sample_workspace(nominal, workspace, 70, 11).poses;
  for (const Estimator estimator : kEstimators) {
    double sum = 0;
    constexpr int kRobots = 40;
    for (std::uint64_t seed = 0; seed < kRobots; ++seed) {
      const Mechanism actual = disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, seed);
      const auto measured = simulate(actual, nominal, {{-1, poses, 60}}, noise, seed).measurements;
      IdentificationOptions options;
      options.estimator = estimator;
      options.noise = noise;
      const Identification result = identify(nominal, measured, options);
      ASSERT_TRUE(result.converged);
      const RowMatrix errors = result.parameters - actual.parameters();
      for (Index i = 0; i < errors.size(); ++i) {
        const double variance = result.covariance(i, i);
        sum += variance > 0 ? errors.data()[i] * errors.data()[i] / variance : 0;
      }
    }
    // 23 correlated parameters of 40 robots: four standard errors are about 0.3.
    EXPECT_NEAR(sum / (23 * kRobots), 1, 0.3) << static_cast<int>(estimator);
  }
}

TEST(MixedEstimation, JointTakesPosesThatWereSeenInPart) {
  for (const auto& [nominal, workspace] :
       {testing::cranks_and_slider(), testing::struts_and_sliders()}) {
    const Mechanism actual = disturb(nominal, {1e-3, 1e-3, 1e-3}, 7);
    const RowMatrix poses = sample_workspace(nominal, workspace, 60, 3).poses;
    const Index position = position_size(nominal.pose_space());
    Observations observations;
    const auto everywhere = [&](const RowMatrix& values, Index columns) {
      return Observed{values, RowMatrix::Constant(values.rows(), columns, 1e-5)};
    };
    observations.readings = everywhere(inverse_kinematics(actual, poses), nominal.leg_count());
    observations.poses = everywhere(poses, nominal.dof());
    for (Index i = 0; i < 60; i += 2) {
      observations.poses.values.row(i).tail(poses.cols() - position).setConstant(kMissing);
    }
    observations.readings.values(5, 1) = kMissing;
    const symkin::Setup setup = symkin::Setup::of(nominal);
    JointOptions options;
    options.start = starting_poses(nominal, setup, observations, workspace.home);
    EXPECT_TRUE(options.start.allFinite()) << nominal.name();
    const Layout layout = Layout::of_all_parameters(nominal, setup);
    EXPECT_EQ(layout.columns(), total(nominal));
    const JointFit fit = fit_jointly(nominal, setup, observations, layout, options);
    EXPECT_TRUE(fit.converged) << fit.failure;
    EXPECT_TRUE(fit.aside.empty());
    EXPECT_LT((fit.setup.parameters - actual.parameters()).cwiseAbs().maxCoeff(), 1e-7)
        << nominal.name();
  }
}

TEST(MixedEstimation, PosesMeasuredInFullGiveTheFitOfTheGeneralElimination) {
  const auto [nominal, workspace] = testing::cranks_and_slider();
  const Robot made = robot(nominal, workspace, 40, {1e-4, 1e-4, 2e-5});
  const symkin::Setup setup = symkin::Setup::of(nominal);
  Observations observations;
  observations.readings = {made.measured.readings, RowMatrix::Constant(40, 3, 2e-5)};
  observations.poses = {made.measured.poses, RowMatrix::Constant(40, 3, 1e-4)};
  JointOptions options;
  options.start = made.measured.poses;
  const Layout layout = Layout::of_all_parameters(nominal, setup);
  const JointFit fit = fit_jointly(nominal, setup, observations, layout, options);
  // A column without a value leaves nothing but the general elimination.
  observations.reported = {RowMatrix::Constant(40, 3, kMissing), RowMatrix::Ones(40, 3)};
  const JointFit general = fit_jointly(nominal, setup, observations, layout, options);
  ASSERT_TRUE(fit.converged && general.converged);
  const Vector deviations = general.covariance.diagonal().cwiseSqrt();
  EXPECT_LT((fit.change - general.change).cwiseQuotient(deviations).norm(), 1e-6);
  EXPECT_LT((fit.covariance - general.covariance).norm(), 1e-6 * general.covariance.norm());
}

TEST(MixedEstimation, FreesTheCurvatureOfSensorsOfEveryChain) {
  const auto [nominal, workspace] = testing::cranks_and_slider();
  const RowMatrix poses = sample_workspace(nominal, workspace, 80, 3).poses;
  RowMatrix readings = inverse_kinematics(nominal, poses);
  // q = psi + offset + c psi^2 of the sensors of a crank and of the slider.
  for (const Index leg : {0, 2}) {
    for (Index i = 0; i < 80; ++i) {
      double& psi = readings(i, leg);
      const double straight = psi;
      for (int k = 0; k < 50; ++k) {
        psi = straight - 1e-3 * psi * psi;
      }
    }
  }
  const symkin::Setup setup = symkin::Setup::of(nominal);
  const UnknownList list(setup);
  Layout layout = Layout::of_all_parameters(nominal, setup);
  Index columns = layout.columns();
  for (const Index leg : {0, 2}) {
    layout.column[static_cast<std::size_t>(list.curvature(leg))] = columns++;
  }
  layout.prior = Vector::Constant(columns, std::numeric_limits<double>::infinity());
  Observations observations;
  observations.readings = {readings, RowMatrix::Constant(80, 3, 1e-5)};
  observations.poses = {poses, RowMatrix::Constant(80, 3, 1e-5)};
  JointOptions options;
  options.start = poses;
  const JointFit fit = fit_jointly(nominal, setup, observations, layout, options);
  ASSERT_TRUE(fit.converged) << fit.failure;
  EXPECT_NEAR(fit.setup.curvature(0, 0), 1e-3, 1e-8);
  EXPECT_NEAR(fit.setup.curvature(2, 0), 1e-3, 1e-8);
  EXPECT_LT((fit.setup.parameters - nominal.parameters()).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(MixedEstimation, NamesTheUnknownsThatALegHas) {
  const Mechanism mechanism = testing::cranks_and_slider().mechanism;
  const symkin::Setup setup = symkin::Setup::of(mechanism);
  const std::vector<std::string> names = unknown_names(mechanism, setup);
  const UnknownList list(setup);
  EXPECT_EQ(names[static_cast<std::size_t>(list.leg(0))], "leg1.proximal_length");
  EXPECT_EQ(names[static_cast<std::size_t>(list.leg(2))], "");
  EXPECT_EQ(names[static_cast<std::size_t>(list.leg(2) + 1)], "leg3.distal_length");
  EXPECT_EQ(names[static_cast<std::size_t>(list.leg(2) + 7)], "leg3.sensor_offset");
  Layout layout = Layout::of_all_parameters(mechanism, setup);
  EXPECT_NO_THROW(layout.check(mechanism, setup));
  layout.column[static_cast<std::size_t>(list.leg(2))] = 0;
  EXPECT_THROW(layout.check(mechanism, setup), InvalidInput);
}

TEST(MixedEstimation, HasRowsOfAsManyColumnsAsEachLegHasUnknowns) {
  const auto [mechanism, workspace] = testing::struts_and_sliders();
  const RowMatrix poses = sample_workspace(mechanism, workspace, 8, 3).poses;
  ASSERT_EQ(mechanism.estimated_count(0), 8);
  ASSERT_EQ(mechanism.estimated_count(1), 10);
  const RowMatrix all = mechanism_rows(mechanism, poses, RowKind::paper);
  ASSERT_EQ(all.cols(), 3 * (8 + 10));
  MeasurementNoise noise{1e-4, 1e-4, 1e-5};
  const RowMatrix whitened = mechanism_rows(mechanism, poses, RowKind::noise_aware, noise);
  ASSERT_EQ(whitened.cols(), all.cols());
  for (Index leg = 0; leg < 6; ++leg) {
    const Index first = mechanism.first_estimated(leg);
    const Index p = mechanism.estimated_count(leg);
    const RowMatrix own = observability_rows(mechanism, leg, poses, RowKind::paper);
    EXPECT_EQ(all(Eigen::seqN(leg, 8, 6), Eigen::seqN(first, p)), own);
    EXPECT_EQ(LegRows(mechanism, leg, poses, RowKind::paper).parameters(), p);
    // Not whitened beside the others, of the first leg alone the same.
    const RowMatrix alone = observability_rows(mechanism, leg, poses, RowKind::noise_aware, noise);
    ASSERT_EQ(alone.cols(), p);
    if (leg == 0) {
      EXPECT_LT((whitened(Eigen::seqN(0, 8, 6), Eigen::seqN(0, p)) - alone).norm(),
                1e-12 * alone.norm());
    }
  }
}

TEST(MixedEstimation, ExpectsNoErrorOfWhatALegDoesNotHave) {
  const auto [mechanism, workspace] = testing::cranks_and_slider();
  const RowMatrix poses = sample_workspace(mechanism, workspace, 20, 3).poses;
  const AccuracyWeights weights = accuracy_weights(mechanism, poses);
  ASSERT_EQ(weights.position.rows(), 3 * 8);
  EXPECT_TRUE(weights.position.row(2 * 8).isZero(0));
  EXPECT_EQ(Tolerances({1, 1, 1}).deviations(mechanism, 2)[0], 0);
  EXPECT_EQ(Tolerances({1, 2, 3}).deviations(mechanism, 0)[7], 2);  // an angle
  EXPECT_EQ(Tolerances({1, 2, 3}).deviations(mechanism, 2)[7], 1);  // a length
}

TEST(MixedEstimation, LooksForEccentricityWhereJointsTurn) {
  const auto [nominal, workspace] = testing::cranks_and_slider();
  const MeasurementNoise noise{1e-4, 1e-4, 2e-5};
  Robot made = robot(nominal, workspace, 60, noise);
  made.measured.readings.col(0).array() += 0.05 * made.measured.readings.col(0).array().cos();
  IdentificationOptions options;
  options.noise = noise;
  options.estimator = Estimator::joint;
  const Identification found = identify(nominal, made.measured, options);
  const Diagnosis diagnosis =
      diagnose(nominal.with_parameters(found.parameters), made.measured, noise, {}, true, 0.01);
  std::vector<Index> legs;
  for (const ResidualTest& test : diagnosis.tests) {
    if (test.suspect == Suspect::sensor_eccentricity) {
      legs.push_back(test.leg);
      if (test.leg == 0) {
        EXPECT_LT(test.p_value, 1e-6);
      }
    }
  }
  EXPECT_EQ(legs, (std::vector<Index>{0, 1, -1}));
}

TEST(MixedEstimation, IdentifiesManyRobotsAsOneByOne) {
  const auto [nominal, workspace] = testing::cranks_and_slider();
  const Robot made = robot(nominal, workspace, 60, {1e-4, 1e-4, 0});
  IdentificationOptions options;
  const Fleet fleet = identify_many(nominal, {MeasuredRobot::of(nominal, made.measured)}, options);
  const Identification one = identify(nominal, made.measured, options);
  EXPECT_EQ(fleet.failures[0], "");
  const Vector deviations = one.covariance.diagonal().cwiseSqrt();
  const RowMatrix off = fleet.parameters.reshaped<Eigen::RowMajor>(3, 8) - one.parameters;
  EXPECT_LT((off.reshaped<Eigen::RowMajor>().array().abs() - 1e-6 * deviations.array()).maxCoeff(),
            1e-15);
}

TEST(MixedEstimation, CountsThePosesThatEachLegNeeds) {
  const auto [nominal, workspace] = testing::cranks_and_slider();
  const Robot made = robot(nominal, workspace, 7, {1e-4, 1e-4, 0});
  try {
    identify(nominal, made.measured);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("leg 1 was measured at 7 poses; its 8 parameters"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace symkin
