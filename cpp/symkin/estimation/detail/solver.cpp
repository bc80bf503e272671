// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/solver.hpp"

#include <ceres/manifold.h>
#include <ceres/solver.h>

#include <algorithm>

#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

constexpr int kMaxPasses = 50;
constexpr double kStill = 1e-9;  // of a parameter, or of 1 m or rad

}  // namespace

SolverOutcome solve_dense(ceres::Problem& problem, int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = max_iterations;
  // Starts as Gauss-Newton, which needs a handful of steps; damped when a step fails.
  options.initial_trust_region_radius = 1e8;
  options.function_tolerance = 1e-10;
  options.gradient_tolerance = 1e-10;
  options.parameter_tolerance = 1e-10;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  SolverOutcome outcome;
  outcome.converged = summary.termination_type == ceres::CONVERGENCE;
  outcome.iterations = summary.num_successful_steps;
  outcome.failure = outcome.converged ? "" : summary.message;
  return outcome;
}

SolverOutcome fit_until_still(Eigen::Ref<Vector> parameters,
                              const std::function<SolverOutcome()>& fit) {
  SolverOutcome total;
  double change = 0;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    check_interrupt();
    const Vector before = parameters;
    const SolverOutcome last = fit();
    total.iterations += last.iterations;
    total.converged = last.converged;
    total.failure = last.failure;
    const Vector size = parameters.cwiseAbs().cwiseMax(1);
    change = (parameters - before).cwiseQuotient(size).lpNorm<Eigen::Infinity>();
    if (!last.converged || change < kStill) {
      return total;
    }
  }
  total.converged = false;
  total.failure = "the weights still moved the estimate after " + std::to_string(kMaxPasses) +
                  " passes, by " + std::to_string(change) + " in the last";
  return total;
}

void hold_others(ceres::Problem& problem, Eigen::Ref<Vector> block,
                 const std::vector<Index>& estimated) {
  std::vector<int> held;
  for (Index i = 0; i < block.size(); ++i) {
    if (!std::binary_search(estimated.begin(), estimated.end(), i)) {
      held.push_back(static_cast<int>(i));
    }
  }
  if (!held.empty()) {
    problem.SetManifold(block.data(),
                        new ceres::SubsetManifold(static_cast<int>(block.size()), held));
  }
}

ceres::Problem::Options shared_loss() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

}  // namespace symkin
