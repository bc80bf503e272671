// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/estimation/observations.hpp"
#include "symkin/estimation/unknowns.hpp"

namespace symkin {

// The whitened rows of poses that fit_jointly would have, r of each pose. r is the largest number
// of conditions of a pose; one with fewer has rows of zeros behind its own, and one that is not
// finite has rows of NaN. Those of poses between which something was measured stand at the first.
struct ObservedRows {
  RowMatrix jacobian;  // (N r) x columns
  Vector residual;     // N r
};

// What observations at poses (N x coordinates) say of the columns of a layout: before anything is
// measured, of the exact values at the poses with their deviations; or at an estimate.
// Throws InvalidInput where the observations do not fit the mechanism, or exact ones are redundant.
ObservedRows observed_rows(const Mechanism& mechanism, const Setup& setup,
                           const Observations& observations, const Layout& layout, ConstRows poses);

}  // namespace symkin
