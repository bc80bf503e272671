// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/problem.hpp"

namespace symkin {

// As many candidates as are wanted: the first of `order` that may stand together, and if a minimum
// distance leaves too few of these, any others that fit.
std::vector<Index> rounded(const SelectionProblem& problem, const std::vector<Index>& order);

}  // namespace symkin
