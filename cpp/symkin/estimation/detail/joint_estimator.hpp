// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/estimation/detail/solver.hpp"
#include "symkin/estimation/detail/whitened_closures.hpp"
#include "symkin/estimation/identification.hpp"

namespace symkin {

// Maximum likelihood of all legs together, from `start` (legs x p, the implicit estimate). At a
// pose the closures of the legs that were read have the covariance H Sigma H' + diag((dh/dpsi)^2
// sigma_q^2), H the stacked dh/dpose; it is taken anew at the estimate until both agree. A robust
// loss is one of the pose: it bends where the norm of the pose's whitened closures is the loss's
// scale times the root of their number.
struct JointEstimate {
  RowMatrix parameters;     // legs x p
  WhitenedClosures system;  // at the estimate
  Vector loss_weights;      // of the system's poses, 1 without a loss
  SolverOutcome outcome;
};
JointEstimate estimate_joint(const Mechanism& mechanism, const MeasurementSet& measurements,
                             const RowMatrix& start, const IdentificationOptions& options);

// Inverse of the information of all whitened rows, weighted by the loss, (legs p) x (legs p).
RowMatrix joint_covariance(const JointEstimate& estimate);

}  // namespace symkin
