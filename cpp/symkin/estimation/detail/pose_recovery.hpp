// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/estimation/detail/latent_problem.hpp"

namespace symkin {

// Takes in the poses that a problem has set aside: each starts at poses with near readings, is
// relaxed with its own observations alone, and counts, where they are explained best, if every leg
// keeps its working mode and all together their aspect. Returns how many were taken.
Index take_in(const Mechanism& mechanism, const Observations& observations, LatentProblem& problem);

}  // namespace symkin
