// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/identification/identification.hpp"
#include "symkin/identification/solver.hpp"

namespace symkin {

// Maximum likelihood of all legs together, from `start` (legs x p, the implicit estimate) into
// `parameters`. At a pose the closures of the legs that were read have the covariance
// H Sigma H' + diag((dh/dpsi)^2 sigma_q^2), H the stacked dh/dpose; it is taken anew at the
// estimate until both agree. `jacobian` gets the whitened rows at the estimate.
struct JointEstimate {
  RowMatrix parameters;  // legs x p
  RowMatrix covariance;  // (legs p) x (legs p)
  SolverOutcome outcome;
};
JointEstimate estimate_joint(const Mechanism& mechanism, const MeasurementSet& measurements,
                             const RowMatrix& start, const IdentificationOptions& options);

}  // namespace symkin
