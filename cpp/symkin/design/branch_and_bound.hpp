// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/column_blocks.hpp"
#include "symkin/design/kernels.hpp"

namespace symkin {

// A proof that no choice of `count` candidates is better than a known one, or a better one.
struct ProofProblem {
  const ColumnBlocks& candidates;  // whitened rows; only those that can be in a better choice
  Shape shape;
  const RowMatrix& fixed;  // whitened
  Index count;
  std::vector<Index> incumbent;  // positions in `candidates`
  double log_det;                // of the incumbent, whitened
  Index clusters;                // to start from; the proof does not depend on it, its time does
  double time_limit_s;
};

struct Proof {
  std::vector<Index> best;  // positions
  double log_det = 0;
  double bound = 0;     // no choice has a larger log_det
  bool proven = false;  // bound <= log_det + kProofTolerance
  Index nodes = 0;
};

// Of log det: a choice that is better by less is not looked for.
constexpr double kProofTolerance = 1e-8;

Proof prove_optimum(const ProofProblem& problem);

}  // namespace symkin
