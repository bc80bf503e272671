// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/leg_estimators.hpp"

#include <ceres/cost_function.h>
#include <ceres/crs_matrix.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <memory>

#include "support/mechanisms.hpp"
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

// For residuals that are `spread` times larger than standard normal ones; null for none.
std::unique_ptr<ceres::LossFunction> loss_of_ceres(const RobustLoss& loss, double spread) {
  switch (loss.kind) {
    case RobustLoss::Kind::none:
      break;
    case RobustLoss::Kind::huber:
      return std::make_unique<ceres::HuberLoss>(1.345 * spread);
    case RobustLoss::Kind::cauchy:
      return std::make_unique<ceres::CauchyLoss>(2.385 * spread);
    case RobustLoss::Kind::tukey:
      return std::make_unique<ceres::TukeyLoss>(4.685 * spread);
  }
  return nullptr;
}

// What Ceres is told of one pose: its closure, or its reading less the measured one (Eq. 15), in
// deviations.
class PoseCost final : public ceres::CostFunction {
 public:
  PoseCost(const LegData& data, Index row, bool inverse, double factor)
      : data_(data), row_(row), inverse_(inverse), factor_(factor) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->push_back(static_cast<int>(data.model.parameter_count()));
  }

  bool Evaluate(double const* const* values, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Vector> parameters(values[0], data_.model.parameter_count());
    const RowMatrix pose = data_.poses.row(row_);
    Vector reading = data_.readings.segment<1>(row_);
    Vector difference(1);
    if (inverse_) {
      Vector expected(1);
      data_.model.inverse_kinematics(parameters, data_.working_mode, pose, expected);
      data_.model.reading_differences(parameters, expected, reading, difference);
      reading += difference;
    }
    ClosureRows rows;
    data_.model.linearise(parameters, pose, reading, rows);
    residuals[0] = factor_ * (inverse_ ? difference[0] : rows.closure[0]);
    if (jacobians != nullptr) {
      const double scale = inverse_ ? -factor_ / rows.by_reading[0] : factor_;
      Eigen::Map<RowMatrix>(jacobians[0], 1, parameters.size()) = scale * rows.by_parameters;
    }
    return std::isfinite(residuals[0]);
  }

 private:
  const LegData& data_;
  Index row_;
  bool inverse_;
  double factor_;
};

// The same optimum by Ceres: passes with fixed weights until nothing moves.
Vector by_ceres(const LegData& data, Vector parameters, const IdentificationOptions& options) {
  const bool inverse = options.estimator == Estimator::inverse;
  for (int pass = 0; pass < 200; ++pass) {
    const Vector before = parameters;
    WhitenedLeg leg;
    whiten(data, parameters, options.noise, leg);
    Vector factors = leg.factors;
    Vector residuals = leg.rows.closure;
    if (inverse) {
      const Vector by_reading = leg.rows.by_reading;
      factors.setConstant(1 /
                          std::sqrt(leg.variances.cwiseQuotient(by_reading.cwiseAbs2()).mean()));
      data.model.inverse_kinematics(parameters, data.working_mode, data.poses, residuals);
      data.model.reading_differences(parameters, Vector(residuals), data.readings, residuals);
    }
    const double spread = options.loss.spread(residuals.cwiseProduct(factors));
    const auto loss = loss_of_ceres(options.loss, spread);
    ceres::Problem::Options ownership;
    ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(ownership);
    for (Index row = 0; row < factors.size(); ++row) {
      problem.AddResidualBlock(new PoseCost(data, row, inverse, factors[row]), loss.get(),
                               parameters.data());
    }
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_QR;
    solver.logging_type = ceres::SILENT;
    solver.initial_trust_region_radius = 1e12;
    solver.max_num_iterations = 200;
    solver.function_tolerance = solver.gradient_tolerance = solver.parameter_tolerance = 1e-16;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    // Ceres stops where the cost cannot be told from its rounding, half of the digits early.
    std::vector<double> rest;
    ceres::CRSMatrix jacobian;
    problem.Evaluate({}, nullptr, &rest, nullptr, &jacobian);
    const Eigen::Map<RowMatrix> rows(jacobian.values.data(), jacobian.num_rows, jacobian.num_cols);
    parameters -= Eigen::MatrixXd(rows).colPivHouseholderQr().solve(
        Eigen::Map<Vector>(rest.data(), jacobian.num_rows));
    if ((parameters - before).lpNorm<Eigen::Infinity>() < 1e-12) {
      break;
    }
  }
  return parameters;
}

LegData leg_data(const Mechanism& mechanism, const MeasurementSet& measured, Index leg) {
  return {mechanism.model(leg),
          mechanism.leg(leg).working_mode,
          rows_of_leg(measured, leg, PoseUse::all),
          measured.poses,
          measured.readings.col(leg),
          mechanism.estimated_parameters(leg)};
}

MeasurementSet measure(const Case& robot, const MeasurementNoise& noise, int gross) {
  const Mechanism actual = disturb(robot.nominal, Tolerances{1e-3, 1e-3, 1e-3}, 5);
  const RowMatrix poses = sample_workspace(robot.nominal, robot.workspace, 50, 11).poses;
  MeasurementSet measured =
      simulate(actual, robot.nominal, {{-1, poses, 40}}, noise, 5).measurements;
  for (Index row = 0; row < gross; ++row) {
    measured.poses(3 + 11 * row, 0) += 0.003;
  }
  return measured;
}

TEST(LegEstimators, ReachTheOptimumThatCeresReaches) {
  for (const Case& robot : cases()) {
    for (const Estimator estimator : {Estimator::implicit, Estimator::inverse}) {
      for (const RobustLoss::Kind loss :
           {RobustLoss::Kind::none, RobustLoss::Kind::huber, RobustLoss::Kind::cauchy}) {
        IdentificationOptions options;
        options.estimator = estimator;
        options.noise = {1e-4, 1e-4, 2e-5};
        options.loss.kind = loss;
        const MeasurementSet measured =
            measure(robot, options.noise, loss == RobustLoss::Kind::none ? 0 : 3);
        const LegData data = leg_data(robot.nominal, measured, 1);
        const Vector& start = robot.nominal.leg(1).parameters;
        WhitenedLeg whitened;
        LegRoom room;
        whiten(data, start, options.noise, whitened);
        const LegEstimate estimate = estimator == Estimator::inverse
                                         ? estimate_inverse(data, start, options, room)
                                         : estimate_implicit(data, start, whitened, options, room);
        ASSERT_TRUE(estimate.outcome.converged) << robot.name << estimate.outcome.failure;
        const Vector expected = by_ceres(data, start, options);
        const Vector size = expected.cwiseAbs().cwiseMax(1);
        EXPECT_LT((estimate.parameters - expected).cwiseQuotient(size).lpNorm<Eigen::Infinity>(),
                  1e-9)
            << robot.name << ", estimator " << static_cast<int>(estimator) << ", loss "
            << static_cast<int>(loss);
      }
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
    WhitenedLeg whitened;
    LegRoom room;
    whiten(data, near, options.noise, whitened);
    const Vector expected = estimate_implicit(data, near, whitened, options, room).parameters;
    for (int trial = 0; trial < 10; ++trial) {
      Vector far = near;
      for (Index i = 0; i < far.size() - 2; ++i) {
        far[i] += 0.2 * random.uniform() - 0.1;
      }
      whiten(data, far, options.noise, whitened);
      const LegEstimate estimate = estimate_implicit(data, far, whitened, options, room);
      EXPECT_TRUE(estimate.outcome.converged) << estimate.outcome.failure;
      EXPECT_LT((estimate.parameters - expected).norm(), 1e-8);
    }
  }
}

TEST(LegEstimators, LossesAreThoseOfCeres) {
  for (const RobustLoss::Kind kind :
       {RobustLoss::Kind::huber, RobustLoss::Kind::cauchy, RobustLoss::Kind::tukey}) {
    const RobustLoss loss{kind, 0};
    for (const double square : {0.0, 0.5, 3.0, 30.0, 3000.0}) {
      double expected[3];
      loss_of_ceres(loss, 1.3)->Evaluate(square, expected);
      const RobustLoss::Value value = loss.evaluate(square, 1.3);
      EXPECT_NEAR(value.cost, expected[0], 1e-12 * (1 + expected[0]));
      EXPECT_NEAR(value.weight, expected[1], 1e-14);
    }
  }
}

}  // namespace
}  // namespace symkin
