// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/estimation/detail/solver.hpp"
#include "symkin/estimation/identification.hpp"

namespace symkin {

// The poses and readings that one leg uses.
struct LegData {
  const LegModel& model;
  int working_mode;
  RowMatrix poses;
  Vector readings;
  std::vector<Index> estimated;  // columns of the parameters
};

// Where an estimator ended, and how it weighed the poses.
struct LegEstimate {
  Vector parameters;
  SolverOutcome outcome;
  Vector loss_weights;  // of the robust loss, 1 a pose without one
};

// Gauss-Newton on g - psi, unweighted.
LegEstimate estimate_paper(const LegData& data, const Vector& start,
                           const IdentificationOptions& options);
// The same cost by Levenberg-Marquardt.
LegEstimate estimate_inverse(const LegData& data, const Vector& start,
                             const IdentificationOptions& options);
// Whitened closures, their variances taken anew at the estimate until both agree.
LegEstimate estimate_implicit(const LegData& data, const Vector& start,
                              const IdentificationOptions& options);

}  // namespace symkin
