// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/approximate_design.hpp"
#include "symkin/design/certificate.hpp"
#include "symkin/design/problem.hpp"
#include "symkin/support/random.hpp"

namespace symkin {

// The two approximate designs of all candidates, what they prove, and the candidates that matter.
struct DesignBounds {
  std::vector<Index> pool;     // ascending; candidates of the designs and those of largest d_j
  std::vector<Index> search;   // ascending; the few of them from which the best sets are made
  ApproximateDesign distinct;  // weights of the pool's members, no repeats
  ApproximateDesign repeats;   // the same with repeats
  Certificate certificate;     // the bounds alone
  Index passes = 0;            // over all candidates
};

// Solved on a sample first; a pass over all candidates then bounds, finds what the sample lacks,
// and is repeated until the bounds are within the gap (of log det). The default costs 5e-5 of
// efficiency with eight parameters.
DesignBounds bound_designs(const SelectionProblem& problem, Random& random, double gap = 4e-4);

}  // namespace symkin
