// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "symkin/design/criterion_exchange.hpp"
#include "symkin/design/design_bounds.hpp"
#include "symkin/design/determinant_search.hpp"
#include "symkin/design/problem.hpp"
#include "symkin/design/rounding.hpp"
#include "symkin/design/sort_unique.hpp"
#include "symkin/design/verification.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

// Kicks of a quarter to two thirds of the poses, of so many at most: smaller ones come back to the
// same set too often, larger ones cost more than they find.
constexpr Index kSmallestKick = 6;
constexpr Index kLargestKick = 16;
constexpr int kVerifications = 20;
constexpr double kRidge = 1e-6;  // of the mean information of a candidate

// The pool, the largest weight of the design without repeats first.
std::vector<Index> by_weight(const DesignBounds& bounds) {
  std::vector<Index> order(bounds.pool.size());
  std::iota(order.begin(), order.end(), Index{0});
  const Vector& weights = bounds.distinct.weights;
  std::stable_sort(order.begin(), order.end(),
                   [&](Index a, Index b) { return weights[a] > weights[b]; });
  for (Index& i : order) {
    i = bounds.pool[static_cast<std::size_t>(i)];
  }
  return order;
}

// Poses that do not show every parameter have a determinant of zero, which no exchange may change:
// a little information about everything leads out of it.
std::vector<Index> made_regular(const SelectionProblem& problem, const std::vector<Index>& pool,
                                const std::vector<Index>& chosen) {
  if (std::isfinite(problem.log_det(chosen))) {
    return chosen;
  }
  DeterminantSearch search(problem, pool, chosen, kRidge);
  search.descend();
  return search.chosen();
}

void join(std::vector<Index>& pool, const std::vector<Index>& others) {
  pool.insert(pool.end(), others.begin(), others.end());
  sort_unique(pool);
}

void kick_and_descend(const SelectionProblem& problem, DeterminantSearch& search, Random& random) {
  std::vector<Index> best = search.state();
  double best_log_det = search.log_det();
  const Index most = std::clamp<Index>(2 * problem.free_count / 3, 1, kLargestKick);
  const Index least = std::clamp<Index>(problem.free_count / 4, 1, kSmallestKick);
  for (int kick = 0; kick < problem.options.kicks; ++kick) {
    check_interrupt();
    search.kick(best, least + random.below(most - least + 1), random);
    search.descend(best_log_det);
    if (search.log_det() > best_log_det + 1e-9) {
      best = search.state();
      best_log_det = search.log_det();
    }
  }
  search.restore(best);
}

}  // namespace

Choice select_exchange(const SelectionProblem& problem) {
  Choice choice;
  Random random(problem.options.seed);
  const DesignBounds bounds = bound_designs(problem, random);
  choice.certificate = bounds.certificate;
  choice.passes = bounds.passes;
  choice.chosen = rounded(problem, by_weight(bounds));
  {
    std::vector<Index> pool = bounds.search;
    join(pool, choice.chosen);
    choice.chosen = made_regular(problem, pool, choice.chosen);
    DeterminantSearch search(problem, pool, choice.chosen);
    search.descend();
    kick_and_descend(problem, search, random);
    choice.chosen = search.chosen();
    choice.exchanges = search.exchanges();
  }
  std::vector<Index> pool = bounds.pool;
  std::vector<Index> better = choice.chosen;
  for (int round = 0; round < kVerifications && !better.empty(); ++round) {
    join(pool, better);
    DeterminantSearch search(problem, pool, choice.chosen);
    search.descend();
    choice.chosen = search.chosen();
    choice.exchanges += search.exchanges();
    better = improving_candidates(problem, choice.chosen);
    ++choice.passes;
  }
  const bool determinant = problem.options.criterion == Criterion::O1;
  // Poses that do not show every parameter have no other criterion either; they are refused.
  const bool regular = std::isfinite(problem.log_det(choice.chosen));
  return determinant || !regular ? choice : exchange_for_criterion(problem, std::move(choice));
}

}  // namespace symkin
