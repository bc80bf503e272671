// SPDX-License-Identifier: MIT
#include "symkin/identification/solver.hpp"

#include <ceres/solver.h>

namespace symkin {

SolverOutcome solve_dense(ceres::Problem& problem, int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-13;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  SolverOutcome outcome;
  outcome.converged = summary.termination_type == ceres::CONVERGENCE;
  outcome.iterations = static_cast<int>(summary.iterations.size());
  outcome.failure = outcome.converged ? "" : summary.message;
  return outcome;
}

ceres::Problem::Options shared_loss() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

}  // namespace symkin
