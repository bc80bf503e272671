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
  std::vector<Index> estimated;  // which of the parameters; the others stay
};

// The leg's closures at some parameters, their derivatives by the estimated ones, and one over
// their standard deviations by the declared noise. Of several closures at a pose each less what
// those before it say of it, so that their errors are independent.
struct WhitenedLeg {
  ClosureRows rows;
  Vector variances, factors;
};
void whiten(const LegData& data, const Vector& parameters, const MeasurementNoise& noise,
            WhitenedLeg& leg);

// Where an estimator ended, and how it weighed the poses.
struct LegEstimate {
  Vector parameters;
  SolverOutcome outcome;
  Vector loss_weights;   // of the robust loss, one a closure; 1 without one
  WhitenedLeg whitened;  // at the parameters
};

// What a leg's fit needs beside its result. Leg after leg in the same room asks for no memory.
struct LegRoom {
  struct State {
    Vector parameters;
    WhitenedLeg leg;    // or g - psi in place of the closures
    Vector weights;     // of the loss
    double spread = 1;  // of the residuals
  };
  State now, former;  // `former` is where the last step began
  Vector residuals, squares, unused;
  SolverRoom solver;
};

// Gauss-Newton on g - psi, unweighted.
LegEstimate estimate_paper(const LegData& data, const Vector& start,
                           const IdentificationOptions& options);
// The same cost by Levenberg-Marquardt, with a loss if asked for.
LegEstimate estimate_inverse(const LegData& data, const Vector& start,
                             const IdentificationOptions& options, LegRoom& room);
// Whitened closures, their variances those at the estimate; `whitened` is the leg at the start.
LegEstimate estimate_implicit(const LegData& data, const Vector& start, WhitenedLeg whitened,
                              const IdentificationOptions& options, LegRoom& room);

}  // namespace symkin
