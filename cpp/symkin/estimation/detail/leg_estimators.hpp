// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/leg_system.hpp"
#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/estimation/detail/robust_fit.hpp"

namespace symkin {

// Where an estimator ended, and how it weighed the poses.
struct LegEstimate {
  Vector parameters;
  SolverOutcome outcome;
  double cost = 0;       // what the solver lowered
  Vector loss_weights;   // of the robust loss, one a closure; 1 without one
  WhitenedLeg whitened;  // at the parameters
  // With a loss.
  RobustStatistics robust;
  std::vector<Index> unguarded;  // rows of the measurements, see unguarded()
};

// With a loss the weights settle after the parameters.
inline constexpr int kRobustSteps = 5;  // times those without

// Gauss-Newton on g - psi, unweighted.
LegEstimate estimate_paper(const LegData& data, const Vector& start,
                           const IdentificationOptions& options);

// One solve of `inverse` (the same cost) or `implicit` (whitened closures, their variances those at
// the estimate) with a loss whose scale is held. Robots one by one are fitted by Ceres; those of a
// fleet side by side (see LegFits), because to build, order and walk through a ceres::Problem of
// some 30 residuals takes ten times as long as its arithmetic there. Both end at the same estimate.
LegEstimate fit_by_ceres(const LegData& data, const Vector& start, const BlockLoss& loss,
                         const IdentificationOptions& options);

// Newton's steps from where a solver ended, the noise taken anew at each, to the last digit of the
// parameters: a cost no longer shows half of them, and weights settle slowly. Whether they lead to
// rest; only short ones are taken.
bool settle(const LegData& data, const BlockLoss& loss, const IdentificationOptions& options,
            LegEstimate& estimate);

// `inverse` or `implicit` with the loss of the options, see fit_robustly(). `leg` counts from 0.
LegEstimate estimate_leg(const LegData& data, Index leg, const Vector& start, WhitenedLeg whitened,
                         const IdentificationOptions& options);

}  // namespace symkin
