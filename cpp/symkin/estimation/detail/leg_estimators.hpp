// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/estimation/identification.hpp"

namespace symkin {

// The poses and readings that one leg uses.
struct LegData {
  const LegModel& model;
  int working_mode;
  std::vector<Index> rows;  // of the measurements
  RowMatrix poses;
  Vector readings;
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
// The same cost by Levenberg-Marquardt with a robust loss, or, of the estimators `implicit` and
// `joint`, whitened closures, whose variances are those at the estimate.
LegEstimate estimate_whitened(const LegData& data, const Vector& start,
                              const IdentificationOptions& options);

}  // namespace symkin
