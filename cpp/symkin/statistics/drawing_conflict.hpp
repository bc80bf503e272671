// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// Whether an estimate is as far from the drawing as the tolerances, that were its priors, say. The
// way from the drawing is normal with covariance T - C, T of the priors and C of the estimate; u
// are its components along the eigenvectors of I - T^-1/2 C T^-1/2, standard normal, mu the
// eigenvalues: 1 for what the data show, 0 for what the prior holds.
struct DrawingConflict {
  Index directions = 0;  // k, those that the data show, mu > 0.1
  double q = 0;          // sum of u^2 over them, chi-square with k degrees
  double p_large = 1;    // of a q so large
  double weighted = 0;   // sum of mu u^2 over all, the most powerful near one against less
  double p_small = 1;    // of a weighted sum so small: nearer to the drawing than robots are made
  double ratio = 1;      // q / k
  double factor = 1;     // on the tolerances, the most likely one of all robots' alike
  double as_drawn = 0;   // twice the log of how much likelier that is than none: exactly as drawn
};

// For changes of parameters from the drawing, their covariance, and the priors' deviations.
DrawingConflict drawing_conflict(const Vector& change, ConstRows covariance,
                                 const Vector& deviations);

}  // namespace symkin
