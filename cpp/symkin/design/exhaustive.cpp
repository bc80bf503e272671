// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "symkin/design/branch_and_bound.hpp"
#include "symkin/design/design_bounds.hpp"
#include "symkin/design/information.hpp"
#include "symkin/design/problem.hpp"
#include "symkin/design/sort_unique.hpp"

namespace symkin {
namespace {

constexpr double kGap = 1e-6;  // of the design that sorts candidates out

// Candidates that a better choice can have, and the chosen ones: with S_N the sum of the N largest
// d_j, one that is forced in leaves at most S_N - d_(N) + d_j.
std::vector<Index> promising(const SelectionProblem& problem, const RowMatrix& factor,
                             const std::vector<Index>& chosen, double log_det) {
  const auto p = static_cast<double>(problem.parameters());
  const RowMatrix transform = problem.own_transform(factor);
  const auto top = screen_candidates(problem.candidates, {{transform, problem.free_count}}).front();
  if (top.empty()) {  // no candidate shows anything
    return chosen;
  }
  const double sum = fixed_trace(transform, problem.fixed) + largest_sum(top, problem.free_count);
  const double needed =
      p * std::exp((log_det + kProofTolerance - determinant_bound(transform, p)) / p) - sum +
      top.back().value;
  // Zero is no candidate's value, so that the floor leaves out the excluded ones.
  const auto kept =
      screen_candidates(problem.candidates,
                        {{transform, problem.candidates.available(), std::max(0.0, needed)}})
          .front();
  std::vector<Index> result = chosen;
  for (const RankedCandidate& candidate : kept) {
    result.push_back(candidate.index);
  }
  sort_unique(result);
  return result;
}

// A good set has its poses near those that the design with repeats would measure again and again;
// somewhat more clusters than these need the fewest nodes.
Index cluster_count(const Vector& weights) { return 4 * (weights.array() > 1e-3).count() / 3 + 1; }

}  // namespace

Choice select_exhaustive(const SelectionProblem& problem) {
  const auto start = std::chrono::steady_clock::now();
  Choice choice = select_exchange(problem);
  Random random(problem.options.seed, 2);
  const DesignBounds bounds = bound_designs(problem, random, kGap);
  const double own = problem.whitening.log_det;
  const double log_det = problem.log_det(choice.chosen);
  const std::vector<Index> kept =
      promising(problem, bounds.distinct.factor, choice.chosen, log_det);
  const ColumnBlocks rows = problem.whitened(kept);
  std::vector<Index> incumbent;
  for (const Index candidate : choice.chosen) {
    incumbent.push_back(std::lower_bound(kept.begin(), kept.end(), candidate) - kept.begin());
  }
  const std::chrono::duration<double> used = std::chrono::steady_clock::now() - start;
  const Proof proof =
      prove_optimum({rows, problem.candidates.shape(), problem.whitened_fixed, problem.free_count,
                     incumbent, log_det - own, cluster_count(bounds.repeats.weights),
                     problem.options.time_limit_s - used.count()});
  choice.nodes = proof.nodes;
  choice.certificate.proven_optimal = proof.proven;
  Certificate& certificate = choice.certificate;
  certificate.log_det_bound_repeats =
      std::min(certificate.log_det_bound_repeats, bounds.certificate.log_det_bound_repeats);
  certificate.log_det_bound_distinct =
      std::min({certificate.log_det_bound_distinct, bounds.certificate.log_det_bound_distinct,
                proof.bound + own});
  choice.chosen.clear();
  for (const Index place : proof.best) {
    choice.chosen.push_back(kept[static_cast<std::size_t>(place)]);
  }
  return choice;
}

}  // namespace symkin
