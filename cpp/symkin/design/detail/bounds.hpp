// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/detail/problem.hpp"

namespace symkin::design::detail {

// Bounds on the total weight of groups of candidates, as the branch and bound sets them.
struct DesignGroups {
  Indices of;  // group of each candidate
  std::vector<double> lower, upper;

  static DesignGroups one(Index candidates, double total) {
    return {Indices(static_cast<std::size_t>(candidates), 0), {total}, {total}};
  }
};

// Maximise log det(fixed + sum w_j C_j^T C_j) over weights 0 <= w_j <= upper with sum `total`
// within the groups' bounds. With upper = 1 it is the relaxation of choosing `total` candidates
// without repeats, with upper = total and one group that with repeats (Kiefer and Wolfowitz).
struct DesignProblem {
  const ColumnBlocks& candidates;  // whitened rows
  const RowMatrix& fixed;          // p x p
  double total;
  double upper;
  const DesignGroups& groups;
};

struct ApproximateDesign {
  Vector weights;
  RowMatrix factor;    // T with T^T T = M^-1
  Vector variances;    // d_j of every candidate
  double log_det = 0;  // of M
  double trace = 0;    // the largest trace(M^-1 M_S) of all designs; p at the optimum
  double least = 0;    // the smallest d_j that this sum takes
};

struct DesignOptions {
  double gap = 1e-4;       // to stop at: no design has a log_det larger by more
  double target = -1e300;  // or as soon as no design reaches this log_det
  double share = 0;        // or with a gap of this share of what log_det is above the target
  int iterations = 200;    // passes over the candidates
};

// From feasible starting weights whose information is positive definite.
ApproximateDesign optimise_design(const DesignProblem& problem, Vector weights,
                                  const DesignOptions& options);

// A start for any upper >= 1 and one group: `total` candidates of weight one, each the best
// addition to those before. If these do not show every parameter all candidates have equal weight.
Vector starting_weights(const ColumnBlocks& candidates, const RowMatrix& fixed, double total);

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
};

// Solved on a sample first; a pass over all candidates then bounds, finds what the sample lacks,
// and is repeated until the bounds are within the gap (of log det). The default costs 5e-5 of
// efficiency with eight parameters.
DesignBounds bound_designs(const Problem& problem, double gap = 4e-4);

}  // namespace symkin::design::detail
