// SPDX-License-Identifier: MIT
#include <algorithm>
#include <numeric>

#include "symkin/design/design_bounds.hpp"
#include "symkin/design/problem.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

std::vector<Index> available(const CandidateBlocks& candidates) {
  std::vector<Index> result;
  for (Index j = 0; j < candidates.size(); ++j) {
    if (!candidates.excluded(j)) {
      result.push_back(j);
    }
  }
  return result;
}

}  // namespace

Choice select_random(const SelectionProblem& problem) {
  Choice choice;
  Random random(problem.options.seed);
  std::vector<Index> rest = available(problem.candidates);
  while (static_cast<Index>(choice.chosen.size()) < problem.free_count && !rest.empty()) {
    std::swap(rest[static_cast<std::size_t>(random.below(static_cast<Index>(rest.size())))],
              rest.back());
    if (problem.spacing.fits(rest.back(), choice.chosen)) {
      choice.chosen.push_back(rest.back());
    }
    rest.pop_back();
  }
  return choice;
}

Choice select_all(const SelectionProblem& problem) {
  Choice choice;
  choice.chosen = available(problem.candidates);
  return choice;
}

}  // namespace symkin
