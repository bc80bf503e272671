// SPDX-License-Identifier: MIT
#include "symkin/identification/leg_estimators.hpp"

#include <ceres/loss_function.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "symkin/identification/costs.hpp"
#include "symkin/identification/solver.hpp"

namespace symkin {
namespace {

using Costs = std::vector<std::unique_ptr<ceres::CostFunction>>;

constexpr int kMaxReweightings = 20;

// g - psi on the sensor's turn, and C = dg/dparam (Eqs. 8, 15).
struct ReadingErrors {
  Vector errors;
  RowMatrix by_parameters;
};

ReadingErrors reading_errors(const LegData& data, const Vector& parameters) {
  const double gain = parameters[parameters.size() - 2];
  Vector roots(data.readings.size());
  data.model.inverse_kinematics(parameters, data.working_mode, data.poses, roots);
  ReadingErrors result;
  result.errors = roots - data.readings;
  if (is_angle(data.model.info().active_joint)) {
    result.errors =
        result.errors.unaryExpr([gain](double error) { return wrap_angle(gain * error) / gain; });
  }
  ClosureRows rows;
  data.model.linearise(parameters, data.poses, data.readings + result.errors, rows);
  result.by_parameters = -(rows.by_parameters.array().colwise() / rows.by_reading.array());
  return result;
}

Vector closure_deviations(const LegData& data, const Vector& parameters,
                          const MeasurementNoise& noise, Vector& closures) {
  ClosureRows rows;
  data.model.linearise_pose(parameters, data.poses, data.readings, rows);
  closures = rows.closure;
  return closure_variances(rows, data.model.info().pose_space, noise).cwiseSqrt();
}

// One weighted least-squares fit with fixed factors, from and into `estimate`.
void fit(Costs costs, const Vector& factors, const RobustLoss& loss, double spread,
         int max_iterations, LegEstimate& estimate) {
  const auto loss_function = loss.make(spread);
  ceres::Problem problem(shared_loss());
  for (std::size_t i = 0; i < costs.size(); ++i) {
    problem.AddResidualBlock(new ScaledCost(std::move(costs[i]), factors[static_cast<Index>(i)]),
                             loss_function.get(), estimate.parameters.data());
  }
  const SolverOutcome outcome = solve_dense(problem, max_iterations);
  estimate.converged = outcome.converged;
  estimate.iterations += outcome.iterations;
  estimate.failure = outcome.failure;
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

Vector standardised_closures(const LegData& data, const Vector& parameters,
                             const MeasurementNoise& noise) {
  Vector closures;
  const Vector deviations = closure_deviations(data, parameters, noise, closures);
  return closures.cwiseQuotient(deviations);
}

double robust_spread(const Vector& standardised) {
  constexpr double kNormalMedian = 0.6744897501960817;  // of |standard normal|
  std::vector<double> magnitudes(standardised.data(), standardised.data() + standardised.size());
  for (double& value : magnitudes) {
    value = std::abs(value);
  }
  const auto middle = magnitudes.begin() + standardised.size() / 2;
  std::nth_element(magnitudes.begin(), middle, magnitudes.end());
  return std::max(1.0, *middle / kNormalMedian);
}

LegEstimate estimate_paper(const LegData& data, const Vector& start,
                           const IdentificationOptions& options) {
  LegEstimate estimate;
  estimate.parameters = start;
  estimate.loss_weights = Vector::Ones(data.readings.size());
  for (; estimate.iterations < options.max_iterations; ++estimate.iterations) {
    const ReadingErrors now = reading_errors(data, estimate.parameters);
    if (!now.errors.allFinite()) {
      estimate.failure = "iteration " + std::to_string(estimate.iterations + 1) + " put " +
                         unreached_pose(now.errors) + " of the leg out of its reach";
      return estimate;
    }
    // Eq. 25, by QR rather than by the inverse of C'C. Its sign: with errors g - psi the update
    // of Eq. 26 must be subtracted.
    const Vector step = Eigen::MatrixXd(now.by_parameters).colPivHouseholderQr().solve(now.errors);
    estimate.parameters -= step;
    const Vector size = estimate.parameters.cwiseAbs().cwiseMax(1);
    if (step.cwiseQuotient(size).lpNorm<Eigen::Infinity>() < 1e-11) {
      estimate.converged = true;
      return estimate;
    }
  }
  estimate.failure = "no convergence in " + std::to_string(options.max_iterations) + " iterations";
  return estimate;
}

LegEstimate estimate_inverse(const LegData& data, const Vector& start,
                             const IdentificationOptions& options) {
  LegEstimate estimate;
  estimate.parameters = start;
  // One factor for all poses, so that the loss counts in standard deviations and the cost stays
  // the paper's.
  ClosureRows rows;
  data.model.linearise_pose(start, data.poses, data.readings, rows);
  const Vector variances = closure_variances(rows, data.model.info().pose_space, options.noise);
  const double deviation = std::sqrt((variances.array() / rows.by_reading.array().square()).mean());
  const Vector factors = Vector::Constant(data.readings.size(), 1 / deviation);
  // The first fit starts far off, where the spread leaves the loss without effect; the others
  // know the residuals.
  const bool robust = options.loss.kind != RobustLoss::Kind::none;
  Vector errors = reading_errors(data, start).errors / deviation;
  if (!errors.allFinite()) {  // Ceres would print an error
    estimate.failure = unreached_pose(errors) + " is out of the leg's reach at the start";
    estimate.loss_weights = Vector::Ones(data.readings.size());
    return estimate;
  }
  double spread = 1;
  for (int pass = 0; pass < (robust ? 3 : 1); ++pass) {
    spread = robust ? robust_spread(errors) : 1;
    fit(data.model.reading_costs(data.working_mode, data.poses, data.readings), factors,
        options.loss, spread, options.max_iterations, estimate);
    errors = reading_errors(data, estimate.parameters).errors / deviation;
  }
  estimate.loss_weights = loss_weights(options.loss, errors, spread);
  return estimate;
}

LegEstimate estimate_implicit(const LegData& data, const Vector& start,
                              const IdentificationOptions& options) {
  LegEstimate estimate;
  estimate.parameters = start;
  Vector closures;
  Vector deviations = closure_deviations(data, start, options.noise, closures);
  double spread = robust_spread(closures.cwiseQuotient(deviations));
  for (int pass = 0; pass < kMaxReweightings; ++pass) {
    const Vector before = estimate.parameters;
    fit(data.model.closure_costs(data.poses, data.readings), deviations.cwiseInverse(),
        options.loss, spread, options.max_iterations, estimate);
    deviations = closure_deviations(data, estimate.parameters, options.noise, closures);
    spread = robust_spread(closures.cwiseQuotient(deviations));
    const Vector size = estimate.parameters.cwiseAbs().cwiseMax(1);
    const Vector change = (estimate.parameters - before).cwiseQuotient(size);
    if (!estimate.converged || change.lpNorm<Eigen::Infinity>() < 1e-9) {
      break;
    }
  }
  estimate.loss_weights = loss_weights(options.loss, closures.cwiseQuotient(deviations), spread);
  return estimate;
}

}  // namespace symkin
