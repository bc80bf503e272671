// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/problem.hpp"

namespace symkin {

// The next best poses: each adds most to log det M of the chosen poses and the spares before it.
// Fewer than asked if no more candidates are allowed.
std::vector<Index> spare_poses(const SelectionProblem& problem, const std::vector<Index>& chosen);

}  // namespace symkin
