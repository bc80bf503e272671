// SPDX-License-Identifier: MIT
#include "symkin/design/criterion_exchange.hpp"

#include <algorithm>

#include "symkin/design/criteria.hpp"
#include "symkin/design/criterion_design.hpp"
#include "symkin/design/criterion_search.hpp"
#include "symkin/design/roots.hpp"
#include "symkin/design/rounding.hpp"
#include "symkin/design/screening.hpp"
#include "symkin/design/sort_unique.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

constexpr Index kErrorPool = 1000;
constexpr Index kEigenvaluePool = 256;  // each pair costs an eigenvalue decomposition
constexpr int kRounds = 12;

// Candidates of largest c G c^T, those of the design and the chosen ones.
std::vector<Index> favoured(const SelectionProblem& problem, const CriterionDesign& design,
                            const std::vector<Index>& chosen) {
  const bool error = problem.options.criterion == Criterion::expected_error;
  const RowMatrix gradient =
      criterion_gradient(problem.information(chosen), problem.options).total();
  const Index keep = std::max(error ? kErrorPool : kEigenvaluePool, 2 * problem.free_count);
  std::vector<Index> pool = chosen;
  pool.insert(pool.end(), design.candidates.begin(), design.candidates.end());
  const auto tops = screen_candidates(problem.candidates, {{lower_root(gradient), keep}});
  for (const RankedCandidate& candidate : tops.front()) {
    pool.push_back(candidate.index);
  }
  sort_unique(pool);
  return pool;
}

void kick_and_descend(const SelectionProblem& problem, CriterionSearch& search, Random& random) {
  std::vector<Index> best = search.state();
  double merit = search.merit();
  for (int kick = 0; kick < problem.options.kicks; ++kick) {
    const Index most = std::min<Index>(6, problem.free_count);
    const Index least = std::min<Index>(2, most);
    check_interrupt();
    search.kick(best, least + random.below(most - least + 1), random);
    search.descend(false);
    if (search.merit() > merit + 1e-9) {
      best = search.state();
      merit = search.merit();
    }
  }
  search.restore(best);
}

}  // namespace

Choice exchange_for_criterion(const SelectionProblem& problem, Choice start) {
  Choice choice = std::move(start);
  Random random(problem.options.seed, 1);
  const CriterionDesign design = criterion_design(problem, choice.chosen);
  choice.certificate.criterion_bound = design.bound;
  const std::vector<Index> other = rounded(problem, design.candidates);
  const auto merit = [&](const std::vector<Index>& chosen) {
    return criterion_merit(problem.information(chosen), problem.options);
  };
  if (other.size() == choice.chosen.size() && merit(other) > merit(choice.chosen)) {
    choice.chosen = other;
  }
  for (int round = 0; round < kRounds; ++round) {
    CriterionSearch search(problem, favoured(problem, design, choice.chosen), choice.chosen);
    ++choice.passes;
    const double before = search.merit();
    search.descend(false);
    if (round == 0) {
      kick_and_descend(problem, search, random);
    }
    search.descend(true);
    choice.chosen = search.chosen();
    choice.exchanges += search.exchanges();
    if (round > 0 && search.merit() <= before) {
      break;
    }
  }
  return choice;
}

}  // namespace symkin
