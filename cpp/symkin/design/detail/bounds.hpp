// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/detail/approximate_design.hpp"
#include "symkin/design/detail/problem.hpp"

namespace symkin::design::detail {

// log det W + p log(trace / p), rounded outward, where W^-1 = T^T T is what the triangular T says
// it is, and `trace` was computed from rows in double precision with that T.
double determinant_bound(const RowMatrix& transform, double trace);

// A largest value over all selections without repeats, and the candidates that it favours.
struct LargestRatio {
  double value;
  std::vector<RankedCandidate> favoured;
};

// Of trace(T M_S T^T), T lower triangular for the candidates' own rows: the fixed information and
// the N largest.
LargestRatio largest_trace(const Problem& problem, const RowMatrix& transform, Index keep);

// Of trace(G M_S G^T) / (offset + trace(L M_S L^T)), G and L lower triangular, offset >= 0, by
// Dinkelbach's method: a pass over all candidates for each value that is tried, few in practice.
// Infinite if some selection has no denominator.
struct Ratio {
  RowMatrix gain;
  RowMatrix loss;
  double offset;
};
LargestRatio largest_ratio(const Problem& problem, const Ratio& ratio, Index keep);

// The two approximate designs of all candidates, what they prove, and the candidates that matter.
struct DesignBounds {
  Indices pool;                // ascending; candidates of the designs and those of largest d_j
  Indices search;              // ascending; the few of them from which the best sets are made
  ApproximateDesign distinct;  // weights of the pool's members, no repeats
  ApproximateDesign repeats;   // the same with repeats
  Certificate certificate;     // the bounds alone
  Index passes = 0;            // over all candidates
};

// Solved on a sample first; a pass over all candidates then bounds, finds what the sample lacks,
// and is repeated until the bounds are within the gap (of log det). The default costs 5e-5 of
// efficiency with eight parameters.
DesignBounds bound_designs(const Problem& problem, Random& random, double gap = 4e-4);

}  // namespace symkin::design::detail
