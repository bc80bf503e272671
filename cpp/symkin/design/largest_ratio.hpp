// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/problem.hpp"
#include "symkin/design/screening.hpp"

namespace symkin {

// The largest value over all selections without repeats, and the candidates that it favours.
struct LargestRatio {
  double value;
  std::vector<RankedCandidate> favoured;
};

// Of trace(T M_S T^T), T lower triangular: the fixed information and the N largest.
LargestRatio largest_trace(const SelectionProblem& problem, const RowMatrix& transform, Index keep);

// Of trace(G M_S G^T) / (offset + trace(L M_S L^T)), G and L lower triangular, offset >= 0, by
// Dinkelbach's method: a pass over all candidates for each value that is tried, few in practice.
// Infinite if some selection has no denominator.
struct Ratio {
  RowMatrix gain;
  RowMatrix loss;
  double offset;
};
LargestRatio largest_ratio(const SelectionProblem& problem, const Ratio& ratio, Index keep);

}  // namespace symkin
