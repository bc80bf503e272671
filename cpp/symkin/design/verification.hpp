// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/problem.hpp"

namespace symkin {

// One pass over all candidates: those whose exchange for some chosen one raises log det M, the best
// few hundred of them, ascending. None: no single exchange can improve the selection.
std::vector<Index> improving_candidates(const SelectionProblem& problem,
                                        const std::vector<Index>& chosen);

}  // namespace symkin
