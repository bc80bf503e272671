// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <vector>

#include "symkin/design/screening.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

// How far a selection can be from the best possible. For any positive definite W and any set S,
// det M_S <= det W (trace(W^-1 M_S) / p)^p; over all sets the trace is at most that of the fixed
// information and of the N largest d_j (no pose twice), or of N times the largest (repeats
// allowed, the bound of Kiefer and Wolfowitz). Efficiencies are (det M_S / bound)^(1/p).
struct Certificate {
  double log_det_bound_repeats = std::numeric_limits<double>::infinity();
  double log_det_bound_distinct = std::numeric_limits<double>::infinity();
  double efficiency_repeats = 0;
  double efficiency_distinct = 0;
  // Of the criterion that was optimised: no set without repeats has a larger O1 to O5, or a smaller
  // expected error. The efficiency is that of the determinant for O1, value / bound for O2 to O5,
  // and bound / value for the expected error.
  double criterion_bound = 0;
  double criterion_efficiency = 0;
  bool proven_optimal = false;  // no other set is better by more than rounding

  // Fills the efficiencies.
  void compare(double log_det, Index parameters);
};

// log det W + p log(trace / p), rounded outward, where W^-1 = T^T T is what the triangular T says
// it is, and `trace` was computed from rows in double precision with that T.
double determinant_bound(const RowMatrix& transform, double trace);

// trace(T F T^T): what the information F (p x p) adds to the trace of a bound.
double fixed_trace(const RowMatrix& transform, const RowMatrix& fixed);

}  // namespace symkin
