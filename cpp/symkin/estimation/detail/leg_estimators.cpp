// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/leg_estimators.hpp"

#include <ceres/loss_function.h>

#include <cmath>

#include "symkin/estimation/detail/costs.hpp"
#include "symkin/estimation/detail/solver.hpp"

namespace symkin {
namespace {

using Costs = std::vector<std::unique_ptr<ceres::CostFunction>>;

// g - psi on the sensor's turn, and C = dg/dparam (Eqs. 8, 15).
struct ReadingErrors {
  Vector errors;
  RowMatrix by_parameters;
};

ReadingErrors reading_errors(const LegData& data, const Vector& parameters) {
  Vector roots(data.readings.size());
  data.model.inverse_kinematics(parameters, data.working_mode, data.poses, roots);
  ReadingErrors result;
  result.errors.resize(roots.size());
  data.model.reading_differences(parameters, roots, data.readings, result.errors);
  ClosureRows rows;
  data.model.linearise(parameters, data.poses, data.readings + result.errors, rows);
  result.by_parameters = -(rows.by_parameters.array().colwise() / rows.by_reading.array());
  result.by_parameters = RowMatrix(result.by_parameters(Eigen::all, data.estimated));
  return result;
}

Vector closure_deviations(const LegData& data, const Vector& parameters,
                          const MeasurementNoise& noise, Vector& closures) {
  ClosureRows rows;
  data.model.linearise_pose(parameters, data.poses, data.readings, rows);
  closures = rows.closure;
  return closure_variances(rows, data.model.info().pose_space, noise).cwiseSqrt();
}

// Typical standard deviation of g - psi.
double reading_deviation(const LegData& data, const Vector& parameters,
                         const MeasurementNoise& noise) {
  ClosureRows rows;
  data.model.linearise_pose(parameters, data.poses, data.readings, rows);
  const Vector variances = closure_variances(rows, data.model.info().pose_space, noise);
  return std::sqrt((variances.array() / rows.by_reading.array().square()).mean());
}

// One weighted least-squares fit with fixed factors, from and into `parameters`.
SolverOutcome fit(Costs costs, const LegData& data, const Vector& factors, const RobustLoss& loss,
                  double spread, int max_iterations, Vector& parameters) {
  const auto loss_function = loss.make(spread);
  ceres::Problem problem(shared_loss());
  for (std::size_t i = 0; i < costs.size(); ++i) {
    problem.AddResidualBlock(new ScaledCost(std::move(costs[i]), factors[static_cast<Index>(i)]),
                             loss_function.get(), parameters.data());
  }
  hold_others(problem, parameters, data.estimated);
  return solve_dense(problem, max_iterations);
}

// The first pose without a reading.
std::string unreached_pose(const Vector& errors) {
  Index row = 0;
  errors.array().isFinite().cast<int>().minCoeff(&row);
  return "measured pose " + std::to_string(row + 1);
}

Vector loss_weights(const RobustLoss& loss, const Vector& residuals, double spread) {
  return residuals.unaryExpr([&](double r) { return loss.weight(r, spread); });
}

}  // namespace

LegEstimate estimate_paper(const LegData& data, const Vector& start,
                           const IdentificationOptions& options) {
  LegEstimate estimate;
  estimate.parameters = start;
  estimate.loss_weights = Vector::Ones(data.readings.size());
  SolverOutcome& outcome = estimate.outcome;
  for (; outcome.iterations < options.max_iterations; ++outcome.iterations) {
    const ReadingErrors now = reading_errors(data, estimate.parameters);
    if (!now.errors.allFinite()) {
      outcome.failure = "iteration " + std::to_string(outcome.iterations + 1) + " put " +
                        unreached_pose(now.errors) + " of the leg out of its reach";
      return estimate;
    }
    // Eq. 25, by QR rather than by the inverse of C'C. Its sign: with errors g - psi the update
    // of Eq. 26 must be subtracted.
    const Vector step = Eigen::MatrixXd(now.by_parameters).colPivHouseholderQr().solve(now.errors);
    estimate.parameters(data.estimated) -= step;
    const Vector size = estimate.parameters(data.estimated).cwiseAbs().cwiseMax(1);
    if (step.cwiseQuotient(size).lpNorm<Eigen::Infinity>() < 1e-11) {
      outcome.converged = true;
      return estimate;
    }
  }
  outcome.failure = "no convergence in " + std::to_string(options.max_iterations) + " iterations";
  return estimate;
}

LegEstimate estimate_inverse(const LegData& data, const Vector& start,
                             const IdentificationOptions& options) {
  LegEstimate estimate;
  estimate.parameters = start;
  estimate.loss_weights = Vector::Ones(data.readings.size());
  Vector errors = reading_errors(data, start).errors;
  if (!errors.allFinite()) {  // Ceres would print an error
    estimate.outcome.failure = unreached_pose(errors) + " is out of the leg's reach at the start";
    return estimate;
  }
  // One factor for all poses, so that the loss counts in standard deviations and the cost stays
  // the paper's.
  double deviation = reading_deviation(data, start, options.noise);
  double spread = options.loss.spread(errors / deviation);
  estimate.outcome = fit_until_still(estimate.parameters, [&] {
    SolverOutcome outcome =
        fit(data.model.reading_costs(data.working_mode, data.poses, data.readings), data,
            Vector::Constant(data.readings.size(), 1 / deviation), options.loss, spread,
            options.max_iterations, estimate.parameters);
    errors = reading_errors(data, estimate.parameters).errors;
    if (!errors.allFinite()) {
      outcome = {false, outcome.iterations,
                 unreached_pose(errors) + " is out of the leg's reach at the estimate"};
      return outcome;
    }
    deviation = reading_deviation(data, estimate.parameters, options.noise);
    spread = options.loss.spread(errors / deviation);
    return outcome;
  });
  if (errors.allFinite()) {
    estimate.loss_weights = loss_weights(options.loss, errors / deviation, spread);
  }
  return estimate;
}

LegEstimate estimate_implicit(const LegData& data, const Vector& start,
                              const IdentificationOptions& options) {
  LegEstimate estimate;
  estimate.parameters = start;
  Vector closures;
  Vector deviations = closure_deviations(data, start, options.noise, closures);
  double spread = options.loss.spread(closures.cwiseQuotient(deviations));
  estimate.outcome = fit_until_still(estimate.parameters, [&] {
    SolverOutcome outcome =
        fit(data.model.closure_costs(data.poses, data.readings), data, deviations.cwiseInverse(),
            options.loss, spread, options.max_iterations, estimate.parameters);
    deviations = closure_deviations(data, estimate.parameters, options.noise, closures);
    spread = options.loss.spread(closures.cwiseQuotient(deviations));
    return outcome;
  });
  estimate.loss_weights = loss_weights(options.loss, closures.cwiseQuotient(deviations), spread);
  return estimate;
}

}  // namespace symkin
