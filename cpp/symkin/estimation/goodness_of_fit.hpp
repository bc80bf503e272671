// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

class LinearFit;

// Chi-square of a least-squares problem against its degrees of freedom.
struct GoodnessOfFit {
  std::vector<Index> legs;
  // Squares of the whitened closures, less what a change of the parameters could still explain:
  // nothing for the estimators that minimise it, and what the unweighted ones leave. With a loss
  // that of the poses that it keeps, which are truncated, brought to the scale of all.
  double chi_square = 0;
  // Closures less the rank of their jacobian; with a loss those of the untruncated normal closures
  // that would be as surprising as what it keeps.
  double degrees_of_freedom = 0;
  // What chi-square exceeds, and falls short of, in one of 1000 sound robots. NaN without a degree
  // of freedom.
  double limit = 0;
  double least = 0;

  bool unexplained() const { return chi_square > limit; }
  // Factor on the declared standard deviations: 1, or the root of chi-square per degree of freedom
  // if that is unexplained.
  double spread() const;
};

// `problems` is how many problems of the same robot are tested, so that all of them together keep
// the rate of false alarms.
GoodnessOfFit judged(std::vector<Index> legs, double chi_square, double degrees_of_freedom,
                     Index problems = 1);

// Of so many closures of one leg, over their standard deviations, and what their rows say
// of its parameters.
GoodnessOfFit goodness_of_fit(Index leg, const Vector& standardised, const LinearFit& linear,
                              Index closures, Index problems);

}  // namespace symkin
