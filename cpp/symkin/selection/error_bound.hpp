// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/selection/problem.hpp"

namespace symkin {

// A value that trace(M^-1 B) of no selection without repeats is below. Convexity gives, for any
// positive definite W, trace(M_S^-1 B) >= f^2 / sum_S q_j with f = trace(W^-1 B) and
// q_j = trace(C_j W^-1 B W^-1 C_j^T); the sum is at most that of the largest q_j. W is the
// information of the chosen poses, improved as an approximate design.
double expected_error_bound(const SelectionProblem& problem, const std::vector<Index>& chosen);

}  // namespace symkin
