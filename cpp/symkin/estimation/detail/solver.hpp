// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/problem.h>

#include <functional>

#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

// Minimises a small dense problem to the last useful digit, silently, on one thread.
SolverOutcome solve_dense(ceres::Problem& problem, int max_iterations);

// Repeats `fit`, which moves the parameters to the optimum for weights that depend on them and then
// takes the weights anew, until the parameters stay still. What still moves after the last pass has
// not converged.
SolverOutcome fit_until_still(Eigen::Ref<Vector> parameters,
                              const std::function<SolverOutcome()>& fit);

// A problem that takes over its cost functions, but not its loss.
// Keeps all but the `estimated` of a block's values as they are. The block has residuals already.
void hold_others(ceres::Problem& problem, Eigen::Ref<Vector> block,
                 const std::vector<Index>& estimated);

ceres::Problem::Options shared_loss();

}  // namespace symkin
