// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

// By which factors a workshop's robots deviate from the drawing, a factor for each kind of
// parameter.
struct FleetTolerances {
  Vector factors;         // on the tolerances, as standard deviations
  Vector log_deviations;  // standard deviations of their logarithms; infinite if nothing shows one
  int iterations = 0;
  bool converged = false;
};

// Maximum likelihood by Fisher scoring. `information` has for each robot what its data alone say of
// its parameters in tolerances, T^1/2 J'J T^1/2, one below the other (robots p x p); `scores` what
// they ask for, T^1/2 J' rho (robots x p); `kinds` the kind of each parameter, 0 to their number
// - 1.
FleetTolerances fleet_tolerances(ConstRows information, ConstRows scores,
                                 const std::vector<int>& kinds);

}  // namespace symkin
