// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/column_blocks.hpp"
#include "symkin/design/kernels.hpp"
#include "symkin/support/random.hpp"

namespace symkin {

// Bounds on the total weight of groups of candidates, as the branch and bound sets them.
struct DesignGroups {
  std::vector<Index> of;  // group of each candidate
  std::vector<double> lower, upper;
};

// Maximise log det(fixed + sum w_j C_j^T C_j) over weights 0 <= w_j <= upper with sum `total`, and
// within the groups' bounds if there are groups. With upper = 1 it is the relaxation of choosing
// `total` candidates without repeats, with upper = total that with repeats (Kiefer and Wolfowitz).
struct DesignProblem {
  const ColumnBlocks& candidates;  // whitened rows
  Shape shape;
  const RowMatrix& fixed;  // p x p
  double total;
  double upper;
  const DesignGroups* groups = nullptr;
};

struct ApproximateDesign {
  Vector weights;
  RowMatrix factor;    // T with T^T T = M^-1
  Vector variances;    // d_j of every candidate
  double log_det = 0;  // of M
  double trace = 0;    // the largest trace(M^-1 M_S) of all designs; p at the optimum
  double least = 0;    // the smallest d_j that this sum takes
  double gap = 0;      // no design of these candidates has a log_det above log_det + gap
  int iterations = 0;
};

struct DesignOptions {
  double gap = 1e-4;       // to stop at
  double target = -1e300;  // or as soon as no design reaches this log_det
  double share = 0;        // or with a gap of this share of what log_det is above the target
  int iterations = 200;    // passes over the candidates
};

// Randomized pairwise exchange of weight (Harman, Filova and Richtarik 2020) from feasible starting
// weights whose information is positive definite.
ApproximateDesign optimise_design(const DesignProblem& problem, Vector weights,
                                  const DesignOptions& options, Random& random);

// A start for any upper >= 1 without groups: `total` candidates of weight one, each the best
// addition to those before. If these do not show every parameter all candidates have equal weight.
Vector starting_weights(const DesignProblem& problem);

// The largest sum w_j d_j that the weights' bounds allow, above trace(M^-1 (M_S - fixed)) of any
// set S, and the smallest d_j that has a part in it.
struct LargestSum {
  double sum;
  double least;
};
LargestSum largest_weighted_sum(const DesignProblem& problem, const Vector& variances);

}  // namespace symkin
