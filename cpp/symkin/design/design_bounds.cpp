// SPDX-License-Identifier: MIT
#include "symkin/design/design_bounds.hpp"
#include "symkin/design/sort_unique.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace symkin {
namespace {

constexpr Index kSample = 4096;
constexpr Index kSearch = 400;        // of largest d_j, to search for sets
constexpr Index kLargestPool = 4000;  // of largest d_j, for the design without repeats
constexpr Index kThinnest = 75;       // one of so many candidates is in the pool
constexpr Index kRepeatsPool = 200;   // and for that with repeats
constexpr int kPasses = 6;
constexpr Index kFirstBlocks = 256;  // of the first pass over some of the blocks
constexpr Index kThickening = 16;    // as many blocks in the next
constexpr double kSampleGap = 5e-2;  // of log det, for the sample

// Every stride-th candidate.
std::vector<Index> sample(const CandidateBlocks& candidates, Index stride) {
  std::vector<Index> result;
  Index seen = 0;
  for (Index j = 0; j < candidates.size(); ++j) {
    if (!candidates.excluded(j) && seen++ % stride == 0) {
      result.push_back(j);
    }
  }
  return result;
}

Vector carried_weights(const std::vector<Index>& from, const Vector& weights,
                       const std::vector<Index>& to) {
  Vector result = Vector::Zero(static_cast<Index>(to.size()));
  std::size_t at = 0;
  for (std::size_t i = 0; i < to.size(); ++i) {
    while (at < from.size() && from[at] < to[i]) {
      ++at;
    }
    if (at < from.size() && from[at] == to[i]) {
      result[static_cast<Index>(i)] = weights[static_cast<Index>(at)];
    }
  }
  return result;
}

class BoundingDesigns {
 public:
  BoundingDesigns(const SelectionProblem& problem, Random& random, double gap)
      : problem_(problem),
        random_(random),
        gap_(gap),
        total_(static_cast<double>(problem.free_count)),
        stride_(std::max<Index>(
            1, problem.candidates.available() / std::max(kSample, 4 * problem.free_count))) {}

  DesignBounds run() {
    result_.pool = sample(problem_.candidates, stride_);
    {
      const ColumnBlocks rows = problem_.whitened(result_.pool);
      const Vector start = starting_weights(design_problem(rows, 1));
      result_.distinct.weights = result_.repeats.weights = start;
      solve(rows, kSampleGap);
    }
    // Passes over few of the blocks cost little and save some over all of them.
    for (Index stride = problem_.candidates.blocks() / kFirstBlocks; stride > 1;
         stride /= kThickening) {
      next_pool(screen(problem_.own_transform(result_.distinct.factor),
                       problem_.own_transform(result_.repeats.factor), stride));
      solve(problem_.whitened(result_.pool), gap_);
    }
    while (pass() > gap_ && result_.passes < kPasses) {
      solve(problem_.whitened(result_.pool), gap_ / 2);
    }
    return std::move(result_);
  }

 private:
  DesignProblem design_problem(const ColumnBlocks& rows, double upper) const {
    return {rows, problem_.candidates.shape(), problem_.whitened_fixed, total_, upper};
  }

  void solve(const ColumnBlocks& rows, double gap) {
    DesignOptions options;
    options.gap = gap;
    for (ApproximateDesign* design : {&result_.distinct, &result_.repeats}) {
      const double upper = design == &result_.distinct ? 1 : total_;
      *design = optimise_design(design_problem(rows, upper), std::move(design->weights), options,
                                random_);
    }
  }

  // The largest variances in every stride-th block of candidates. What the last candidates show of
  // them, more or less thinly sown than these, saves most of the sorting; it may not show too
  // little.
  std::vector<std::vector<RankedCandidate>> screen(const RowMatrix& distinct,
                                                   const RowMatrix& repeats, Index stride) {
    const Index keep = pool_size(stride);
    const auto floor_of = [&](const ApproximateDesign& design, Index kept) {
      return likely_floor(design.variances, 2 * kept * stride / stride_);
    };
    std::vector<Screen> screens = {
        {distinct, keep, floor_of(result_.distinct, keep)},
        {repeats, kRepeatsPool, floor_of(result_.repeats, kRepeatsPool)}};
    stride_ = stride;
    auto tops = screen_candidates(problem_.candidates, screens, stride);
    if (static_cast<Index>(tops[0].size()) < problem_.free_count || tops[1].empty()) {
      screens[0].floor = screens[1].floor = 0;
      tops = screen_candidates(problem_.candidates, screens, stride);
    }
    return tops;
  }

  Index pool_size(Index stride) const {
    const Index screened = problem_.candidates.available() / stride;
    return std::max(std::clamp(screened / kThinnest, kSearch, kLargestPool),
                    4 * problem_.free_count);
  }

  static double likely_floor(const Vector& variances, Index at) {
    const Index rank = std::min(variances.size() - 1, at);
    Vector sorted = variances;
    std::nth_element(sorted.data(), sorted.data() + rank, sorted.data() + sorted.size(),
                     std::greater<>());
    return 0.97 * sorted[rank];
  }

  // Bounds from all candidates, the next pool, and the larger of the two gaps.
  double pass() {
    const RowMatrix distinct = problem_.own_transform(result_.distinct.factor);
    const RowMatrix repeats = problem_.own_transform(result_.repeats.factor);
    const auto tops = screen(distinct, repeats, 1);
    ++result_.passes;
    Certificate& certificate = result_.certificate;
    const double distinct_bound =
        determinant_bound(distinct, fixed_trace(distinct, problem_.fixed) +
                                        largest_sum(tops[0], problem_.free_count));
    const double repeats_bound = determinant_bound(
        repeats, fixed_trace(repeats, problem_.fixed) + total_ * largest_sum(tops[1], 1));
    certificate.log_det_bound_repeats = std::min(certificate.log_det_bound_repeats, repeats_bound);
    certificate.log_det_bound_distinct = std::min(
        {certificate.log_det_bound_distinct, distinct_bound, certificate.log_det_bound_repeats});
    const double own = problem_.whitening.log_det;
    const double gap = std::max(distinct_bound - own - result_.distinct.log_det,
                                repeats_bound - own - result_.repeats.log_det);
    next_pool(tops);
    return gap;
  }

  void next_pool(const std::vector<std::vector<RankedCandidate>>& tops) {
    std::vector<Index> pool;
    std::vector<Index>& search = result_.search;
    search.clear();
    for (const auto& top : tops) {
      for (const RankedCandidate& candidate : top) {
        pool.push_back(candidate.index);
      }
    }
    const auto searched = std::max(kSearch, 4 * problem_.free_count);
    for (const RankedCandidate& candidate : tops.front()) {
      if (static_cast<Index>(search.size()) < searched) {
        search.push_back(candidate.index);
      }
    }
    for (std::size_t i = 0; i < result_.pool.size(); ++i) {
      const auto at = static_cast<Index>(i);
      if (result_.distinct.weights[at] > 0 || result_.repeats.weights[at] > 0) {
        pool.push_back(result_.pool[i]);
        search.push_back(result_.pool[i]);
      }
    }
    sort_unique(pool);
    sort_unique(search);
    result_.distinct.weights = carried_weights(result_.pool, result_.distinct.weights, pool);
    result_.repeats.weights = carried_weights(result_.pool, result_.repeats.weights, pool);
    result_.pool = std::move(pool);
  }

  const SelectionProblem& problem_;
  Random& random_;
  double gap_;
  double total_;
  Index stride_;  // how much thinner than all candidates the last ones were
  DesignBounds result_;
};

}  // namespace

DesignBounds bound_designs(const SelectionProblem& problem, Random& random, double gap) {
  return BoundingDesigns(problem, random, gap).run();
}

}  // namespace symkin
