// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/leg_estimators.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <memory>

#include "support/mechanisms.hpp"
#include "symkin/estimation/detail/leg_fits.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

struct Case {
  const char* name;
  Mechanism nominal;
  WorkspaceOptions workspace;
};

WorkspaceOptions box(const Vector& half, const Vector& home) {
  WorkspaceOptions options;
  options.lower = home - half;
  options.upper = home + half;
  options.home = home;
  return options;
}

std::vector<Case> cases() {
  // Three extensible legs on wide points, which any pose near home suits.
  Vector parameters(6);
  parameters << 2, kPi / 6, 0.5, -kPi / 3, 1, 0;
  const ChainModel& extensible = leg_model("R[P]R");
  const SymmetryGroup group = SymmetryGroup::named("C3");
  return {
      {"3-RRR", testing::paper_3rrr(), testing::paper_workspace()},
      {"3-RPR",
       {"3-RPR", extensible,
        generate_legs(group, extensible, {parameters, 1}, generating_elements(group, 3))},
       box(Eigen::Vector3d(0.5, 0.5, 0.4), Vector::Zero(3))},
      {"five-bar", testing::five_bar(), box(Eigen::Vector2d(0.1, 0.1), Eigen::Vector2d(0, 0.45))},
      {"hexapod", testing::hexapod(), testing::hexapod_workspace()}};
}

LegData leg_data(const Mechanism& mechanism, const MeasurementSet& measured, Index leg) {
  LegData data{mechanism.model(leg),       mechanism.leg(leg).working_mode,    {}, measured.poses,
               measured.readings.col(leg), mechanism.estimated_parameters(leg)};
  rows_of_leg(MeasuredRobot::of(mechanism, measured), mechanism.leg_count(), leg, PoseUse::all,
              data.rows);
  return data;
}

MeasurementSet measure(const Case& robot, const MeasurementNoise& noise, int gross) {
  const Mechanism actual = disturb(robot.nominal, Tolerances{1e-3, 1e-3, 1e-3}, 5);
  const RowMatrix poses = sample_workspace(robot.nominal, robot.workspace, 90, 11).poses;
  MeasurementSet measured =
      simulate(actual, robot.nominal, {{-1, poses, 80}}, noise, 5).measurements;
  for (Index row = 0; row < gross; ++row) {
    measured.poses(3 + 11 * row, 0) += 0.003;
  }
  return measured;
}

LegEstimate fit(const LegData& data, const Vector& start, const IdentificationOptions& options) {
  WhitenedLeg whitened;
  whiten(data, start, options.noise, whitened);
  return estimate_leg(data, 1, start, whitened, options);
}

LegFit fit_in_lanes(const Mechanism& nominal, const MeasurementSet& measured,
                    const IdentificationOptions& options) {
  const MeasuredRobot robot = MeasuredRobot::of(nominal, measured);
  LegFits legs(nominal, 1, options);
  legs.fit(&robot, 1);
  return legs.of(0);
}

TEST(LegEstimators, OfOneRobotByCeresAndOfAFleetInLanesAgree) {
  for (const Case& robot : cases()) {
    for (const std::string& loss : loss_names()) {
      for (const int gross : {0, 3}) {
        IdentificationOptions options;
        options.noise = {1e-4, 1e-4, 2e-5};
        options.loss = loss_named(loss);
        const MeasurementSet measured = measure(robot, options.noise, gross);
        const LegData data = leg_data(robot.nominal, measured, 1);
        const LegFit lanes = fit_in_lanes(robot.nominal, measured, options);
        const std::string which = std::string(robot.name) + ", " + loss;
        ASSERT_TRUE(lanes.clear) << which;
        const LegEstimate ceres = fit(data, robot.nominal.leg(1).parameters, options);
        ASSERT_TRUE(ceres.outcome.converged) << which << ": " << ceres.outcome.failure;
        // In deviations: the length of the change's effect on the whitened closures.
        const Vector change = (ceres.parameters - lanes.parameters)(data.estimated);
        EXPECT_LT((ceres.whitened.factors.asDiagonal() * ceres.whitened.rows.by_parameters * change)
                      .norm(),
                  1e-6)
            << which;
        EXPECT_EQ(lanes.rejected, (ceres.loss_weights.array() < kRejectedWeight).count()) << which;
      }
    }
  }
}

TEST(LegEstimators, EndWhereTheWeightedClosuresLeaveNoStep) {
  for (const Case& robot : cases()) {
    for (const std::string& loss : loss_names()) {
      IdentificationOptions options;
      options.loss = loss_named(loss);
      const MeasurementSet measured = measure(robot, options.noise, loss == "none" ? 0 : 3);
      const LegData data = leg_data(robot.nominal, measured, 1);
      const LegEstimate found = fit(data, robot.nominal.leg(1).parameters, options);
      // Weights anew from the loss as its definition has them.
      const Vector residuals = found.whitened.rows.closure.cwiseProduct(found.whitened.factors);
      const BlockLoss block(options.loss, 1, 1);
      const Vector weights = residuals.unaryExpr(
          [&](double residual) { return block.at(residual * residual).weight; });
      const RowMatrix rows =
          weights.cwiseSqrt().asDiagonal() *
          (found.whitened.factors.asDiagonal() * found.whitened.rows.by_parameters);
      const Vector step =
          rows.colPivHouseholderQr().solve(weights.cwiseSqrt().cwiseProduct(residuals));
      EXPECT_LT((rows * step).norm(), 1e-6) << robot.name << ", " << loss;
    }
  }
}

TEST(LegEstimators, FindTheirWayFromATenthOfAMetreAndARadianOff) {
  const Case robot = cases()[0];
  IdentificationOptions options;
  const MeasurementSet measured = measure(robot, options.noise, 0);
  Random random(7);
  for (Index leg = 0; leg < 3; ++leg) {
    const LegData data = leg_data(robot.nominal, measured, leg);
    const Vector& near = robot.nominal.leg(leg).parameters;
    const Vector expected = fit(data, near, options).parameters;
    for (int trial = 0; trial < 10; ++trial) {
      Vector far = near;
      for (Index i = 0; i < far.size() - 2; ++i) {
        far[i] += 0.2 * random.uniform() - 0.1;
      }
      const LegEstimate estimate = fit(data, far, options);
      EXPECT_TRUE(estimate.outcome.converged) << estimate.outcome.failure;
      EXPECT_LT((estimate.parameters - expected).norm(), 1e-8);
    }
  }
}

// Two closures a pose, whose covariance keeps its determinant.
TEST(LegEstimators, WhitenSeveralClosuresSoThatTheirErrorsAreIndependent) {
  const Mechanism mechanism = testing::three_rps();
  RowMatrix poses(2, 7);
  poses << 0.02, -0.01, 1.7, 1, 0, 0, 0,  //
      0, 0.03, 1.75, std::cos(0.05), std::sin(0.05), 0, 0;
  const MeasurementSet measured{poses, RowMatrix::Constant(2, 3, 0.9), {-1, -1}};
  const LegData data = leg_data(mechanism, measured, 1);
  const Vector parameters = mechanism.leg(1).parameters;
  const MeasurementNoise noise{1e-4, 2e-4, 3e-4};
  const Vector of_pose = noise.pose_variances(mechanism.pose_space());
  const auto covariance = [&](const ClosureRows& rows, Index a, Index b) {
    return rows.by_pose.row(a).cwiseProduct(rows.by_pose.row(b)).dot(of_pose.transpose()) +
           noise.reading * noise.reading * rows.by_reading[a] * rows.by_reading[b];
  };
  ClosureRows raw;
  linearise_closures(data, parameters, raw);
  WhitenedLeg leg;
  whiten(data, parameters, noise, leg);
  for (const Index first : {0, 2}) {
    const double both = covariance(raw, first, first + 1);
    const double area = covariance(raw, first, first) * covariance(raw, first + 1, first + 1);
    EXPECT_GT(std::abs(both), 1e-3 * std::sqrt(area));
    EXPECT_NEAR(covariance(leg.rows, first, first + 1), 0, 1e-12 * std::sqrt(area));
    EXPECT_NEAR(leg.variances[first] * leg.variances[first + 1] / (area - both * both), 1, 1e-9);
    EXPECT_EQ(leg.rows.closure[first], raw.closure[first]);
    const double share = both / covariance(raw, first, first);
    EXPECT_NEAR(leg.rows.closure[first + 1], raw.closure[first + 1] - share * raw.closure[first],
                1e-12);
  }
  // Of two closures the reading's error is one.
  whiten(data, parameters, {0, 0, 1e-4}, leg);
  EXPECT_EQ(leg.variances, Vector::Zero(4));
}

}  // namespace
}  // namespace symkin
