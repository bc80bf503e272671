// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/problem.h>

#include <string>

namespace symkin {

struct SolverOutcome {
  bool converged = false;
  int iterations = 0;
  std::string failure;
};

// Minimises a small dense problem to the last useful digit, silently, on one thread.
SolverOutcome solve_dense(ceres::Problem& problem, int max_iterations);

// A problem that takes over its cost functions, but not its loss.
ceres::Problem::Options shared_loss();

}  // namespace symkin
