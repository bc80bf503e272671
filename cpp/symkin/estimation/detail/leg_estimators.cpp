// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/leg_estimators.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace symkin {
namespace {

// The largest of a step of the estimated parameters, of those beyond 1 over their size.
double relative_step(const LegData& data, const Vector& parameters, const Vector& step) {
  double largest = 0;
  for (Index i = 0; i < step.size(); ++i) {
    const double size = std::abs(parameters[data.estimated[static_cast<std::size_t>(i)]]);
    largest = std::max(largest, std::abs(step[i]) / std::max(size, 1.0));
  }
  return largest;
}

}  // namespace

LegEstimate estimate_paper(const LegData& data, const Vector& start,
                           const IdentificationOptions& options) {
  LegEstimate estimate;
  estimate.parameters = start;
  estimate.loss_weights = Vector::Ones(data.readings.size());
  SolverOutcome& outcome = estimate.outcome;
  ClosureRows rows;
  for (; outcome.iterations < options.max_iterations; ++outcome.iterations) {
    linearise_readings(data, estimate.parameters, rows);
    if (!rows.closure.allFinite()) {
      outcome.failure = "iteration " + std::to_string(outcome.iterations + 1) + " put " +
                        unreached_pose(rows.closure) + " of the leg out of its reach";
      break;
    }
    // Eq. 25, by QR rather than by the inverse of C'C. Its sign: with errors g - psi the update
    // of Eq. 26 must be subtracted.
    const Vector step = scaled_least_squares(rows.by_parameters, rows.closure);
    estimate.parameters(data.estimated) -= step;
    if (relative_step(data, estimate.parameters, step) < 1e-11) {
      outcome.converged = true;
      break;
    }
  }
  if (!outcome.converged && outcome.failure.empty()) {
    outcome.failure = "no convergence in " + std::to_string(options.max_iterations) + " iterations";
  }
  whiten(data, estimate.parameters, options.noise, estimate.whitened);
  return estimate;
}

}  // namespace symkin
