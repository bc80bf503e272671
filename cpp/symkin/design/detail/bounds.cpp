// SPDX-License-Identifier: MIT
#include "symkin/design/detail/bounds.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "symkin/support/dense.hpp"

namespace symkin::design::detail {
namespace {

constexpr Index kSample = 4096;
constexpr Index kSearch = 400;        // of largest d_j, to search for sets
constexpr Index kLargestPool = 4000;  // of largest d_j, for the design without repeats
constexpr Index kThinnest = 75;       // one of so many candidates is in the pool
constexpr Index kRepeatsPool = 200;   // and for that with repeats
constexpr int kPasses = 6;
constexpr Index kFirstBlocks = 256;         // of the first pass over some of the blocks
constexpr Index kThickening = 16;           // as many blocks in the next
constexpr double kSampleGap = 5e-2;         // of log det, for the sample
constexpr double kVarianceRounding = 1e-6;  // of a variance, generously
constexpr double kConverged = 1e-12;        // relative, of a ratio
constexpr int kRatioPasses = 30;            // it converges faster than linearly

// trace(T F T^T): what the information F (p x p) adds to the trace of a bound.
double fixed_trace(const RowMatrix& transform, const RowMatrix& fixed) {
  return (transform * fixed).cwiseProduct(transform).sum();
}

Vector carried_weights(const Indices& from, const Vector& weights, const Indices& to) {
  Vector result = Vector::Zero(size_of(to));
  for (Index i = 0; i < result.size(); ++i) {
    const auto found = std::lower_bound(from.begin(), from.end(), at(to, i));
    if (found != from.end() && *found == at(to, i)) {
      result[i] = weights[found - from.begin()];
    }
  }
  return result;
}

class BoundingDesigns {
 public:
  BoundingDesigns(const Problem& problem, double gap)
      : problem_(problem), gap_(gap), total_(static_cast<double>(problem.free_count)) {}

  DesignBounds run() {
    const Index sample = std::max(kSample, 4 * problem_.free_count);
    result_.pool = problem_.available(std::max<Index>(1, problem_.candidates.available() / sample));
    {
      const ColumnBlocks rows = problem_.whitened(result_.pool);
      result_.distinct.weights = starting_weights(rows, problem_.whitened_fixed, total_);
      result_.repeats.weights = result_.distinct.weights;
      solve(rows, kSampleGap);
    }
    // Passes over few of the blocks cost little and save some over all of them.
    for (Index stride = problem_.candidates.blocks() / kFirstBlocks; stride > 1;
         stride /= kThickening) {
      next_pool(screen(stride));
      solve(problem_.whitened(result_.pool), gap_);
    }
    for (int passes = 1; pass() > gap_ && passes < kPasses; ++passes) {
      solve(problem_.whitened(result_.pool), gap_ / 10);
    }
    return std::move(result_);
  }

 private:
  void solve(const ColumnBlocks& rows, double gap) {
    const DesignGroups all = DesignGroups::one(rows.count(), total_);
    DesignOptions options;
    options.gap = gap;
    for (ApproximateDesign* design : {&result_.distinct, &result_.repeats}) {
      const double upper = design == &result_.distinct ? 1 : total_;
      *design = optimise_design({rows, problem_.whitened_fixed, total_, upper, all},
                                std::move(design->weights), options);
    }
  }

  // The largest variances in every stride-th block of candidates by either design.
  std::vector<std::vector<RankedCandidate>> screen(Index stride) const {
    const Index screened = problem_.candidates.available() / stride;
    const Index keep =
        std::max(std::clamp(screened / kThinnest, kSearch, kLargestPool), 4 * problem_.free_count);
    // The pool itself has as many above `least` as the bounds count; far below it nothing matters,
    // nor does, of all candidates, what is below as many of the pool as are kept.
    const auto screen_of = [&](const ApproximateDesign& design, Index kept) {
      double floor = design.least / 2;
      if (stride <= 1 && kept < design.variances.size()) {
        Vector values = design.variances;
        std::nth_element(values.begin(), values.begin() + kept, values.end(), std::greater<>());
        floor = std::max(floor, values[kept]);
      }
      return Screen{problem_.own_transform(design.factor), kept, (1 - kVarianceRounding) * floor};
    };
    return screen_candidates(
        problem_.candidates,
        {screen_of(result_.distinct, keep), screen_of(result_.repeats, kRepeatsPool)}, stride);
  }

  // Bounds from all candidates, the next pool, and the larger of the two gaps.
  double pass() {
    const auto tops = screen(1);
    const auto bound_of = [&](const ApproximateDesign& design, double sum) {
      const RowMatrix transform = problem_.own_transform(design.factor);
      return determinant_bound(transform, fixed_trace(transform, problem_.fixed) + sum);
    };
    const double distinct = bound_of(result_.distinct, largest_sum(tops[0], problem_.free_count));
    const double repeats = bound_of(result_.repeats, total_ * largest_sum(tops[1], 1));
    result_.certificate.tighten(repeats, distinct);
    const double gap =
        std::max(distinct - result_.distinct.log_det, repeats - result_.repeats.log_det) -
        problem_.whitening.log_det;
    next_pool(tops);
    return gap;
  }

  void next_pool(const std::vector<std::vector<RankedCandidate>>& tops) {
    const Index searched = std::max(kSearch, 4 * problem_.free_count);
    Indices weighty;
    for (Index i = 0; i < size_of(result_.pool); ++i) {
      if (result_.distinct.weights[i] > 0 || result_.repeats.weights[i] > 0) {
        weighty.push_back(at(result_.pool, i));
      }
    }
    Indices favoured = indices_of(tops[0]);
    Indices pool = joined(joined(favoured, indices_of(tops[1])), weighty);
    favoured.resize(std::min(favoured.size(), static_cast<std::size_t>(searched)));
    Indices search = joined(std::move(favoured), weighty);
    for (ApproximateDesign* design : {&result_.distinct, &result_.repeats}) {
      design->weights = carried_weights(result_.pool, design->weights, pool);
    }
    result_.pool = std::move(pool);
    result_.search = std::move(search);
  }

  const Problem& problem_;
  double gap_;
  double total_;
  DesignBounds result_;
};

}  // namespace

double determinant_bound(const RowMatrix& transform, double trace) {
  const auto size = static_cast<double>(transform.rows());
  // |fl(T x) - T x| <= p eps |T| |x| <= p eps (|T| |T^-1|) |T x|, component by component: the
  // relative error of d = |T x|^2 and of the sums is below this slack.
  const RowMatrix inverse = lower_inverse(transform);
  const double growth = (transform.cwiseAbs() * inverse.cwiseAbs()).rowwise().sum().maxCoeff();
  const double epsilon = std::numeric_limits<double>::epsilon();
  const double slack = 8 * (size + 4) * epsilon * std::sqrt(size) * growth + 64 * epsilon;
  const double log_det = log_determinant(transform);
  const double bound = log_det + size * (std::log(trace / size) + slack);
  return bound + 16 * epsilon * (std::abs(log_det) + std::abs(bound));
}

LargestRatio largest_trace(const Problem& problem, const RowMatrix& transform, Index keep) {
  auto top = screen_candidates(problem.candidates, {{transform, keep}}).front();
  const double sum = fixed_trace(transform, problem.fixed) + largest_sum(top, problem.free_count);
  return {sum, std::move(top)};
}

LargestRatio largest_ratio(const Problem& problem, const Ratio& ratio, Index keep) {
  // No selection exceeds the value that its own best numerator less value times denominator makes
  // zero; each selection that shows a positive one raises the value to its own ratio.
  LargestRatio result{0, {}};
  for (int pass = 0; pass < kRatioPasses; ++pass) {
    const Screen screen{ratio.gain, keep, -kInfinity, ratio.loss, result.value};
    result.favoured = screen_candidates(problem.candidates, {screen}).front();
    double gain = fixed_trace(ratio.gain, problem.fixed);
    double loss = ratio.offset + fixed_trace(ratio.loss, problem.fixed);
    for (Index i = 0; i < std::min(problem.free_count, size_of(result.favoured)); ++i) {
      const RowMatrix rows = problem.candidates.rows(at(result.favoured, i).index);
      gain += product(rows, ratio.gain.transpose()).squaredNorm();
      loss += product(rows, ratio.loss.transpose()).squaredNorm();
    }
    if (!(loss > 0)) {
      break;
    }
    const double before = result.value;
    result.value = std::max(before, gain / loss);
    if (result.value <= before * (1 + kConverged)) {
      return result;
    }
  }
  result.value = kInfinity;
  return result;
}

DesignBounds bound_designs(const Problem& problem, double gap) {
  return BoundingDesigns(problem, gap).run();
}

}  // namespace symkin::design::detail
