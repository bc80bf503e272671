// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/candidate_blocks.hpp"

namespace symkin {

// D-optimality does not change under a linear map of the parameters, rounding does: the methods
// work on rows x T^T, for which the mean information of the candidates is the identity.
struct Whitening {
  RowMatrix transform;  // T, p x p lower triangular
  double log_det = 0;   // log det M = log det(whitened M) + log_det
};

// `fixed` (p x p) is the information that every selection has: measured and required poses. Throws
// NotIdentifiable with the directions that neither it nor the candidates show (singular values
// below 1e-10 of the largest, columns scaled to length one).
Whitening whiten(const CandidateBlocks& candidates, const RowMatrix& fixed);

}  // namespace symkin
