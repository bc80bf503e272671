// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/problem.hpp"

namespace symkin {

// The exchange method for a criterion other than O1: from the selection of best determinant, kicks
// and exchanges in pools of the candidates that the criterion's gradient favours, until a new pool
// brings nothing.
Choice exchange_for_criterion(const SelectionProblem& problem, Choice start);

}  // namespace symkin
