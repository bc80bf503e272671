// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/design/detail/bounds.hpp"
#include "symkin/design/detail/criteria.hpp"
#include "symkin/design/detail/information.hpp"
#include "symkin/design/detail/problem.hpp"
#include "symkin/design/detail/product_kernels.hpp"
#include "symkin/design/detail/search.hpp"
#include "symkin/support/dense.hpp"

namespace symkin::design::detail {
namespace {

// Kicks of a quarter to two thirds of the poses, of so many at most: smaller ones come back to the
// same set too often, larger ones cost more than they find.
constexpr Index kSmallestKick = 6;
constexpr Index kLargestKick = 16;
constexpr int kVerifications = 20;
constexpr std::uint64_t kStream = 13;    // of the kicks: as good as any for the shipped mechanisms
constexpr double kExchangeRidge = 1e-6;  // of the mean information of a candidate
constexpr Index kParts = 16;             // of the pool, for the kicks
constexpr Index kCriterionPool = 256;
constexpr int kExchangeRounds = 12;

// Poses that do not show every parameter have a determinant of zero, which no exchange may change:
// a little information about everything leads out of it.
Indices made_regular(const Problem& problem, const Indices& pool, const Indices& chosen) {
  if (std::isfinite(problem.log_det(chosen))) {
    return chosen;
  }
  DeterminantSearch search(problem, pool, chosen, kExchangeRidge);
  search.descend();
  return search.chosen();
}

// Poses that may leave the selection, of least variance first, for the candidates' own rows.
std::vector<Leaving> leaving_poses(const Problem& problem, const Indices& chosen,
                                   const RowMatrix& transform) {
  std::vector<Leaving> poses;
  for (const Index candidate : chosen) {
    const RowMatrix rows = problem.candidates.rows(candidate);
    poses.push_back(leaving_pose(rows, product(product(rows, transform.transpose()), transform)));
  }
  std::sort(poses.begin(), poses.end(),
            [](const Leaving& a, const Leaving& b) { return a.trace < b.trace; });
  return poses;
}

// One pass over all candidates: those whose exchange for a chosen one raises log det M, which none
// does unless d_j > d_i.
Indices challengers(const Problem& problem, const Indices& chosen) {
  const RowMatrix factor = inverse_factor(problem.whitened_information(chosen));
  if (factor.size() == 0) {
    return {};
  }
  const RowMatrix transform = problem.own_transform(factor);
  const std::vector<Leaving> poses = leaving_poses(problem, chosen, transform);
  const Shape shape = problem.shape();
  const ProductKernels& kernels = product_kernels();
  std::vector<Indices> found(static_cast<std::size_t>(problem.candidates.chunks()));
  problem.candidates.for_each_block([&](Index chunk, Index first, const double* columns) {
    alignas(64) double traces[kBlock];
    alignas(64) double ratios[kGroup];
    double largest[kGroups];
    AlignedArray gram(shape.rows == 1 ? 0 : shape.gram_size() * kBlock);
    compute_products(columns, shape, transform, traces, shape.rows == 1 ? nullptr : gram.data());
    kernels.find_largest(traces, largest, kGroups);
    for (Index g = 0; g < kGroups; ++g) {
      const Index lane = g * kGroup;
      for (const Leaving& pose : poses) {
        if (!(largest[g] > pose.trace)) {
          break;
        }
        if (kernels.find_ratios(columns + lane_of(lane, shape.width()), shape, gram.data() + lane,
                                traces + lane, {pose.y.data(), pose.s.data(), pose.base},
                                ratios) <= 1 + kGain) {
          continue;
        }
        for (Index k = 0; k < kGroup; ++k) {
          if (ratios[k] > 1 + kGain && !contains(chosen, first + lane + k)) {
            at(found, chunk).push_back(first + lane + k);
          }
        }
      }
    }
  });
  Indices all;
  for (const Indices& of_chunk : found) {
    all.insert(all.end(), of_chunk.begin(), of_chunk.end());
  }
  return joined(std::move(all), {});
}

// For a criterion other than O1: from the selection of best determinant, kicks and exchanges in
// pools of the candidates that the criterion's gradient favours, until a new pool brings nothing.
Selection exchange_for_criterion(const Problem& problem, Selection choice) {
  Random random(problem.options.seed, 1);
  const CriterionDesign design = criterion_design(problem, choice.indices);
  choice.certificate.criterion_bound = design.bound;
  const Indices other = problem.rounded(design.candidates);
  const auto merit = [&](const Indices& chosen) {
    return criterion_merit(problem.information(chosen), problem.options);
  };
  if (other.size() == choice.indices.size() && merit(other) > merit(choice.indices)) {
    choice.indices = other;
  }
  const Index keep = std::max(kCriterionPool, 2 * problem.free_count);
  for (int round = 0; round < kExchangeRounds; ++round) {
    // Candidates of largest c G c^T, those of the design and the chosen ones.
    const RowMatrix gradient =
        criterion_gradient(problem.information(choice.indices), problem.options).total();
    const auto top = screen_candidates(problem.candidates, {{lower_root(gradient), keep}}).front();
    CriterionSearch search(problem,
                           joined(joined(design.candidates, choice.indices), indices_of(top)),
                           choice.indices);
    const double before = search.merit();
    search.descend();
    if (round == 0) {
      const Index most = std::min<Index>(6, problem.free_count);
      search.kick_and_descend(1, std::min<Index>(2, most), most, random);
    }
    search.descend_thoroughly();
    choice.indices = search.chosen();
    if (round > 0 && search.merit() <= before) {
      break;
    }
  }
  return choice;
}

}  // namespace

Selection select_exchange(const Problem& problem) {
  const bool determinant = problem.options.criterion == Criterion::O1;
  Selection choice;
  Random random(problem.options.seed, kStream);
  const DesignBounds bounds = bound_designs(problem);
  choice.certificate = bounds.certificate;
  choice.indices = problem.rounded(by_falling(bounds.distinct.weights, bounds.pool));
  {
    const Indices pool = joined(bounds.search, choice.indices);
    choice.indices = made_regular(problem, pool, choice.indices);
    DeterminantSearch search(problem, pool, choice.indices);
    search.descend();
    if (determinant) {  // from here another criterion finds what it finds from the optimum
      search.kick_and_descend(kParts, std::clamp<Index>(problem.free_count / 4, 1, kSmallestKick),
                              std::clamp<Index>(2 * problem.free_count / 3, 1, kLargestKick),
                              random);
    }
    choice.indices = search.chosen();
  }
  // Until no single exchange with any candidate is an improvement.
  bool improved = determinant;
  for (int round = 0; improved && round < kVerifications; ++round) {
    const Indices better = challengers(problem, choice.indices);
    if (better.empty()) {
      break;
    }
    const Indices pool = joined(joined(better, bounds.search), choice.indices);
    DeterminantSearch search(problem, pool, choice.indices);
    const double before = search.merit();
    search.descend();
    improved = search.merit() > before;  // and not by rounding alone, where M is nearly singular
    choice.indices = improved ? search.chosen() : choice.indices;
  }
  // Poses that do not show every parameter have no other criterion either; they are refused.
  const bool regular = std::isfinite(problem.log_det(choice.indices));
  return determinant || !regular ? choice : exchange_for_criterion(problem, std::move(choice));
}

}  // namespace symkin::design::detail
