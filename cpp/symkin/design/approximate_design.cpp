// SPDX-License-Identifier: MIT
#include "symkin/design/approximate_design.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "symkin/design/information.hpp"
#include "symkin/design/pair_step.hpp"
#include "symkin/design/screening.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr double kLeastMove = 1e-8;    // less weight is none, and less room too
constexpr int kSweeps = 8;             // over the active candidates between two passes over all
constexpr double kGreedyRidge = 1e-3;  // of the whitened unit information

template <typename T>
T& at(std::vector<T>& values, Index i) {
  return values[static_cast<std::size_t>(i)];
}
template <typename T>
const T& at(const std::vector<T>& values, Index i) {
  return values[static_cast<std::size_t>(i)];
}

// Greedy is exact for bounds on disjoint groups: first what every group must hold, then the best of
// the rest that groups still have room for.
LargestSum largest_grouped_sum(const DesignProblem& problem, const Vector& variances) {
  const DesignGroups& groups = *problem.groups;
  std::vector<std::vector<double>> of_group(groups.lower.size());
  for (Index j = 0; j < variances.size(); ++j) {
    at(of_group, groups.of[static_cast<std::size_t>(j)]).push_back(variances[j]);
  }
  LargestSum result{0, std::numeric_limits<double>::infinity()};
  const auto take = [&](auto first, auto last) {
    result.sum += std::accumulate(first, last, 0.0);
    result.least =
        first == last ? result.least : std::min(result.least, *std::min_element(first, last));
  };
  double left = problem.total;
  std::vector<double> rest;
  for (std::size_t g = 0; g < of_group.size(); ++g) {
    std::vector<double>& values = of_group[g];
    const auto room = std::min(values.size(), static_cast<std::size_t>(groups.upper[g]));
    const auto demanded = std::min(room, static_cast<std::size_t>(groups.lower[g]));
    const auto place = [&](std::size_t k) {
      return values.begin() + static_cast<std::ptrdiff_t>(k);
    };
    std::partial_sort(values.begin(), place(room), values.end(), std::greater<>());
    take(values.begin(), place(demanded));
    left -= static_cast<double>(demanded);
    rest.insert(rest.end(), place(demanded), place(room));
  }
  const auto more = std::min(rest.size(), static_cast<std::size_t>(std::max(0.0, left)));
  const auto last = rest.begin() + static_cast<std::ptrdiff_t>(more);
  std::nth_element(rest.begin(), last, rest.end(), std::greater<>());
  take(rest.begin(), last);
  return result;
}

class DesignOptimiser {
 public:
  DesignOptimiser(const DesignProblem& problem, Vector weights, Random& random)
      : problem_(problem),
        random_(random),
        step_(problem.shape),
        weights_(std::move(weights)),
        variances_(AlignedArray(problem.candidates.blocks() * kBlock)),
        group_max_(kGroups),
        ordinary_upper_(problem.upper - 2 * kLeastMove) {
    weights_ = (weights_.array() > 2 * kLeastMove).select(weights_, 0);
    if (problem.groups != nullptr) {
      sums_.assign(problem.groups->lower.size(), 0);
      for (Index j = 0; j < weights_.size(); ++j) {
        at(sums_, group(j)) += weights_[j];
      }
    }
  }

  ApproximateDesign run(const DesignOptions& options) {
    ApproximateDesign result;
    for (;;) {
      check_interrupt();
      rebuild();
      const Vector d = Eigen::Map<const Vector>(variances_.data(), problem_.candidates.count());
      const auto p = static_cast<double>(problem_.shape.parameters);
      const double fixed = (factor_ * problem_.fixed).cwiseProduct(factor_).sum();
      const LargestSum largest = largest_weighted_sum(problem_, d);
      result.trace = fixed + largest.sum;
      result.least = largest.least;
      result.gap = p * std::log(std::max(1.0, result.trace / p));
      result.log_det = log_determinant(factor_);
      if (result.gap <= options.gap || result.log_det + result.gap <= options.target ||
          result.gap <= options.share * (result.log_det - options.target) ||
          result.iterations >= options.iterations) {
        result.variances = d;
        break;
      }
      ++result.iterations;
      choose_active(d);
      sweep();
    }
    result.weights = weights_;
    result.factor = factor_;
    return result;
  }

 private:
  Index group(Index j) const { return problem_.groups == nullptr ? 0 : at(problem_.groups->of, j); }

  // M, its inverse and all variances from the weights.
  void rebuild() {
    const Shape shape = problem_.shape;
    RowMatrix matrix = problem_.fixed;
    RowMatrix rows(shape.rows, shape.parameters);
    for (Index j = 0; j < weights_.size(); ++j) {
      if (weights_[j] > 0) {
        problem_.candidates.get(j, rows.data());
        matrix.noalias() += weights_[j] * rows.transpose() * rows;
      }
    }
    factor_ = demanded_factor(matrix);
    information_.reset(std::move(matrix));
    find_variances(problem_.candidates, factor_, variances_);
  }

  void find_variances(const ColumnBlocks& rows, const RowMatrix& factor, AlignedArray& variances) {
    for (Index b = 0; b < rows.blocks(); ++b) {
      kernels().variance(rows.block(b), factor.data(), problem_.shape,
                         variances.data() + b * kBlock, group_max_.data());
    }
  }

  // The least variance of what may give weight to a candidate of each group: its own members, and
  // if it has room any member of a group that may lose weight.
  template <typename Group, typename Variance>
  void find_least_givers(const std::vector<Index>& givers, const Group& group_of,
                         const Variance& variance) {
    const std::size_t groups = problem_.groups == nullptr ? 1 : sums_.size();
    least_.assign(groups, kNone);
    double least_anywhere = kNone;
    for (const Index j : givers) {
      const Index g = group_of(j);
      at(least_, g) = std::min(at(least_, g), variance(j));
      if (may_lose(g)) {
        least_anywhere = std::min(least_anywhere, variance(j));
      }
    }
    for (std::size_t g = 0; g < groups; ++g) {
      if (may_gain(static_cast<Index>(g))) {
        least_[g] = std::min(least_[g], least_anywhere);
      }
    }
  }

  bool may_lose(Index g) const {
    return problem_.groups == nullptr || at(sums_, g) > at(problem_.groups->lower, g) + kLeastMove;
  }
  bool may_gain(Index g) const {
    return problem_.groups == nullptr || at(sums_, g) < at(problem_.groups->upper, g) - kLeastMove;
  }

  // Those with weight and as many again that gain most by taking some.
  void choose_active(const Vector& d) {
    active_.clear();
    for (Index j = 0; j < d.size(); ++j) {
      if (weights_[j] > 0) {
        active_.push_back(j);
      }
    }
    find_least_givers(
        active_, [&](Index j) { return group(j); }, [&](Index j) { return d[j]; });
    std::vector<std::pair<double, Index>> takers;
    for (Index j = 0; j < d.size(); ++j) {
      const double excess = d[j] - at(least_, group(j));
      if (weights_[j] == 0 && excess > 0) {
        takers.emplace_back(-excess, j);
      }
    }
    const auto wanted =
        std::min(takers.size(), active_.size() + static_cast<std::size_t>(d.size()) / 64);
    const auto last = takers.begin() + static_cast<std::ptrdiff_t>(wanted);
    std::nth_element(takers.begin(), last, takers.end());
    for (auto taker = takers.begin(); taker != last; ++taker) {
      active_.push_back(taker->second);
    }
    rows_.resize(static_cast<Index>(active_.size()), problem_.shape.width());
    columns_ = ColumnBlocks(rows_.rows(), rows_.cols());
    for (Index a = 0; a < rows_.rows(); ++a) {
      problem_.candidates.get(at(active_, a), rows_.row(a).data());
      columns_.set(a, rows_.row(a).data());
    }
  }

  // The takers that gain most, each from the first giver of low variance that may give, and then
  // pairs at random.
  void sweep() {
    const auto size = static_cast<Index>(active_.size());
    AlignedArray d(columns_.blocks() * kBlock);
    std::vector<Index> givers;
    std::vector<std::pair<double, Index>> takers;
    for (int round = 0; round < kSweeps; ++round) {
      const RowMatrix factor = inverse_factor(information_.matrix());
      if (factor.size() == 0) {
        return;
      }
      find_variances(columns_, factor, d);
      givers.clear();
      takers.clear();
      for (Index a = 0; a < size; ++a) {
        if (weights_[at(active_, a)] > 0) {
          givers.push_back(a);
        }
      }
      std::sort(givers.begin(), givers.end(), [&](Index a, Index b) { return d[a] < d[b]; });
      find_least_givers(
          givers, [&](Index a) { return group(at(active_, a)); }, [&](Index a) { return d[a]; });
      for (Index a = 0; a < size; ++a) {
        const double excess = d[a] - at(least_, group(at(active_, a)));
        if (weights_[at(active_, a)] < ordinary_upper_ && excess > 0) {
          takers.emplace_back(-excess, a);
        }
      }
      if (takers.empty()) {
        return;
      }
      std::sort(takers.begin(), takers.end());
      takers.resize(std::min(takers.size(), givers.size()));
      for (std::size_t k = 0; k < takers.size(); ++k) {
        give_first(givers, k, takers[k].second, d);
      }
      for (std::size_t k = 0; k < takers.size(); ++k) {
        move(at(givers, random_.below(static_cast<Index>(givers.size()))),
             at(takers, random_.below(static_cast<Index>(takers.size()))).second);
      }
    }
  }

  void give_first(const std::vector<Index>& givers, std::size_t first, Index taker,
                  const AlignedArray& d) {
    for (std::size_t offset = 0; offset < givers.size(); ++offset) {
      const Index giver = givers[(first + offset) % givers.size()];
      if (d[giver] < d[taker] && move(giver, taker)) {
        return;
      }
    }
  }

  // Whether the bounds allowed it.
  bool move(Index giver, Index taker) {
    const Index from = active_[static_cast<std::size_t>(giver)];
    const Index to = active_[static_cast<std::size_t>(taker)];
    if (from == to) {
      return false;
    }
    double limit = std::min(weights_[from], problem_.upper - weights_[to]);
    const bool across = problem_.groups != nullptr && group(from) != group(to);
    if (across) {
      limit = std::min({limit, at(sums_, group(from)) - at(problem_.groups->lower, group(from)),
                        at(problem_.groups->upper, group(to)) - at(sums_, group(to))});
    }
    if (limit <= kLeastMove) {
      return false;
    }
    const Index r = problem_.shape.rows;
    const double* from_rows = rows_.row(giver).data();
    const double* to_rows = rows_.row(taker).data();
    double step = step_(information_, from_rows, to_rows, limit);
    if (step <= 0) {
      return true;
    }
    step = weights_[from] - step < 2 * kLeastMove ? weights_[from] : step;
    information_.add(to_rows, r, step);
    information_.add(from_rows, r, -step);
    weights_[from] -= step;
    weights_[to] += step;
    if (across) {
      at(sums_, group(from)) -= step;
      at(sums_, group(to)) += step;
    }
    return true;
  }

  const DesignProblem& problem_;
  Random& random_;
  PairStep step_;
  Vector weights_;
  AlignedArray variances_, group_max_;
  double ordinary_upper_;
  std::vector<double> sums_;   // of each group
  std::vector<double> least_;  // variance of a giver to each group
  RowMatrix factor_, rows_;
  Information information_;
  std::vector<Index> active_;
  ColumnBlocks columns_;  // of the active candidates
};

}  // namespace

ApproximateDesign optimise_design(const DesignProblem& problem, Vector weights,
                                  const DesignOptions& options, Random& random) {
  return DesignOptimiser(problem, std::move(weights), random).run(options);
}

Vector starting_weights(const DesignProblem& problem) {
  const Shape shape = problem.shape;
  const Index n = problem.candidates.count();
  const Index p = shape.parameters;
  Information information(problem.fixed + kGreedyRidge * RowMatrix::Identity(p, p));
  const Index blocks = problem.candidates.blocks();
  AlignedArray gram(blocks * shape.gram_size() * kBlock);
  AlignedArray trace(blocks * kBlock);
  AlignedArray group_max(blocks * kGroups);
  const RowMatrix factor = inverse_factor(information.matrix());
  for (Index b = 0; b < blocks; ++b) {
    kernels().gram(problem.candidates.block(b), factor.data(), shape,
                   gram.data() + b * shape.gram_size() * kBlock, trace.data() + b * kBlock,
                   group_max.data() + b * kGroups);
  }
  Vector weights = Vector::Zero(n);
  RowMatrix rows(shape.rows, p);
  Vector u(p);
  for (Index k = 0; k < static_cast<Index>(problem.total); ++k) {
    check_interrupt();
    Index best = -1;
    for (Index j = 0; j < n; ++j) {
      if (weights[j] == 0 && (best < 0 || trace[j] > trace[best])) {
        best = j;
      }
    }
    weights[best] = 1;
    problem.candidates.get(best, rows.data());
    for (Index row = 0; row < shape.rows; ++row) {
      information.multiply_inverse(rows.row(row).data(), u.data());
      const double pivot = 1 + rows.row(row).dot(u);
      information.add(rows.row(row).data(), 1, 1);
      for (Index b = 0; b < blocks; ++b) {
        kernels().gram_update(problem.candidates.block(b), u.data(), -1 / pivot, shape,
                              gram.data() + b * shape.gram_size() * kBlock,
                              trace.data() + b * kBlock, group_max.data() + b * kGroups);
      }
    }
  }
  // The ridge alone would make the smallest eigenvalue kGreedyRidge.
  const RowMatrix ridged = inverse_factor(information.matrix());
  const bool singular = ridged.rowwise().squaredNorm().maxCoeff() > 0.1 / kGreedyRidge;
  return singular ? Vector::Constant(n, problem.total / static_cast<double>(n)) : weights;
}

LargestSum largest_weighted_sum(const DesignProblem& problem, const Vector& variances) {
  if (problem.groups != nullptr) {
    return largest_grouped_sum(problem, variances);
  }
  const double count = std::round(problem.total / problem.upper);
  TopCandidates top(static_cast<Index>(count), -1);
  for (Index j = 0; j < variances.size(); ++j) {
    top.offer(j, variances[j]);
  }
  const std::vector<RankedCandidate> largest = top.sorted();
  return {problem.upper * largest_sum(largest, static_cast<Index>(count)), largest.back().value};
}

}  // namespace symkin
