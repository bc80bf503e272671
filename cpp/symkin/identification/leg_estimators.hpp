// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "symkin/identification/identification.hpp"

namespace symkin {

// The poses and readings that one leg uses.
struct LegData {
  const LegModel& model;
  int working_mode;
  RowMatrix poses;
  Vector readings;
};

// Where an estimator ended, and how it weighed the poses.
struct LegEstimate {
  Vector parameters;
  bool converged = false;
  std::string failure;
  int iterations = 0;
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

// h / sqrt(v) at parameters.
Vector standardised_closures(const LegData& data, const Vector& parameters,
                             const MeasurementNoise& noise);

// How much larger than standard normal the bulk of the residuals is, at least 1: the median
// absolute value over that of a standard normal. Keeps a loss from rejecting everything where the
// declared noise is too small.
double robust_spread(const Vector& standardised);

}  // namespace symkin
