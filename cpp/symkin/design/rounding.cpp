// SPDX-License-Identifier: MIT
#include "symkin/design/rounding.hpp"

#include <algorithm>

namespace symkin {

std::vector<Index> rounded(const SelectionProblem& problem, const std::vector<Index>& order) {
  std::vector<Index> chosen;
  const auto take = [&](Index candidate) {
    if (static_cast<Index>(chosen.size()) < problem.free_count &&
        !problem.candidates.excluded(candidate) && problem.spacing.fits(candidate, chosen)) {
      chosen.push_back(candidate);
    }
  };
  for (const Index candidate : order) {
    take(candidate);
  }
  for (Index j = 0; problem.spacing.active() && j < problem.candidates.size(); ++j) {
    if (std::find(chosen.begin(), chosen.end(), j) == chosen.end()) {
      take(j);
    }
  }
  return chosen;
}

}  // namespace symkin
