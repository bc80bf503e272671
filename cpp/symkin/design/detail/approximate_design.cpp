// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "symkin/design/detail/bounds.hpp"
#include "symkin/design/detail/information.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr double kLeastMove = 1e-8;    // less weight is none, and less room too
constexpr int kSweeps = 8;             // over the active candidates between two passes over all
constexpr double kGreedyRidge = 1e-3;  // of the whitened unit information

struct Taker {
  double excess;  // of its variance over that of who may give to it
  Index member;

  bool operator<(const Taker& other) const {
    return excess > other.excess || (excess == other.excess && member < other.member);
  }
};

class DesignOptimiser {
 public:
  DesignOptimiser(const DesignProblem& problem, Vector weights, Random& random)
      : problem_(problem),
        random_(random),
        shape_(problem.candidates.shape()),
        weights_(std::move(weights)),
        sums_(problem.groups.lower.size(), 0) {
    weights_ = (weights_.array() > 2 * kLeastMove).select(weights_, 0);
    for (Index j = 0; j < weights_.size(); ++j) {
      at(sums_, group(j)) += weights_[j];
    }
  }

  ApproximateDesign run(const DesignOptions& options) {
    const auto p = static_cast<double>(shape_.parameters);
    ApproximateDesign result;
    for (int iteration = 0;; ++iteration) {
      check_interrupt();
      evaluate(result);
      const double gap = p * std::log(std::max(1.0, result.trace / p));
      if (gap <= options.gap || result.log_det + gap <= options.target ||
          gap <= options.share * (result.log_det - options.target) ||
          iteration >= options.iterations) {
        result.weights = weights_;
        return result;
      }
      choose_active(result.variances);
      sweep();
    }
  }

 private:
  Index group(Index j) const { return at(problem_.groups.of, j); }

  // M, its inverse and all variances from the weights.
  void evaluate(ApproximateDesign& result) {
    RowMatrix matrix = problem_.fixed;
    for (Index j = 0; j < weights_.size(); ++j) {
      if (weights_[j] > 0) {
        const RowMatrix rows = problem_.candidates.rows(j);
        matrix.noalias() += weights_[j] * rows.transpose() * rows;
      }
    }
    result.factor = demanded_factor(matrix);
    result.log_det = log_determinant(result.factor);
    result.variances = variances(problem_.candidates, result.factor);
    result.trace = (result.factor * problem_.fixed).cwiseProduct(result.factor).sum();
    add_largest_sum(result);
    information_.reset(std::move(matrix));
  }

  // The largest sum w_j d_j that the weights' bounds allow, above trace(M^-1 (M_S - fixed)) of any
  // set S. Greedy is exact for bounds on disjoint groups: first what every group must hold, then
  // the best of the rest that groups still have room for.
  void add_largest_sum(ApproximateDesign& result) const {
    const DesignGroups& groups = problem_.groups;
    const auto places = [&](double weight) {
      return static_cast<std::ptrdiff_t>(std::round(weight / problem_.upper));
    };
    std::vector<std::vector<double>> of_group(groups.lower.size());
    for (Index j = 0; j < weights_.size(); ++j) {
      at(of_group, group(j)).push_back(result.variances[j]);
    }
    result.least = kNone;
    const auto take = [&](auto first, auto last) {
      for (; first != last; ++first) {
        result.trace += problem_.upper * *first;
        result.least = std::min(result.least, *first);
      }
    };
    std::ptrdiff_t left = places(problem_.total);
    std::vector<double> rest;
    for (std::size_t g = 0; g < of_group.size(); ++g) {
      std::vector<double>& values = of_group[g];
      const auto room = std::min(values.end() - values.begin(), places(groups.upper[g]));
      const auto demanded = std::min(room, places(groups.lower[g]));
      std::partial_sort(values.begin(), values.begin() + room, values.end(), std::greater<>());
      take(values.begin(), values.begin() + demanded);
      left -= demanded;
      rest.insert(rest.end(), values.begin() + demanded, values.begin() + room);
    }
    const auto last = rest.begin() + std::clamp<std::ptrdiff_t>(left, 0, rest.end() - rest.begin());
    std::nth_element(rest.begin(), last, rest.end(), std::greater<>());
    take(rest.begin(), last);
  }

  bool may_lose(Index g) const { return at(sums_, g) > at(problem_.groups.lower, g) + kLeastMove; }
  bool may_gain(Index g) const { return at(sums_, g) < at(problem_.groups.upper, g) - kLeastMove; }

  // The least variance of what may give weight to a candidate of each group: its own members, and
  // if it has room any member of a group that may lose weight.
  template <typename Member, typename Variance>
  std::vector<double> least_givers(const Indices& givers, const Member& member,
                                   const Variance& variance) const {
    std::vector<double> least(sums_.size(), kNone);
    double anywhere = kNone;
    for (const Index i : givers) {
      const Index g = group(member(i));
      at(least, g) = std::min(at(least, g), variance[i]);
      anywhere = may_lose(g) ? std::min(anywhere, variance[i]) : anywhere;
    }
    for (Index g = 0; g < size_of(least); ++g) {
      at(least, g) = may_gain(g) ? std::min(at(least, g), anywhere) : at(least, g);
    }
    return least;
  }

  // Those with weight and as many again that gain most by taking some.
  void choose_active(const Vector& d) {
    active_.clear();
    for (Index j = 0; j < d.size(); ++j) {
      if (weights_[j] > 0) {
        active_.push_back(j);
      }
    }
    const std::vector<double> least = least_givers(
        active_, [](Index j) { return j; }, d);
    std::vector<Taker> takers;
    for (Index j = 0; j < d.size(); ++j) {
      const double excess = d[j] - at(least, group(j));
      if (weights_[j] == 0 && excess > 0) {
        takers.push_back({excess, j});
      }
    }
    const Index wanted = std::min(size_of(takers), size_of(active_) + d.size() / 64);
    std::nth_element(takers.begin(), takers.begin() + wanted, takers.end());
    for (Index k = 0; k < wanted; ++k) {
      active_.push_back(at(takers, k).member);
    }
    rows_ = ColumnBlocks(size_of(active_), shape_);
    for (Index a = 0; a < rows_.count(); ++a) {
      rows_.set(a, problem_.candidates.rows(at(active_, a)).data());
    }
  }

  // The takers that gain most, each from the first giver of low variance that may give, and then
  // pairs at random.
  void sweep() {
    const auto member = [&](Index a) { return at(active_, a); };
    for (int round = 0; round < kSweeps; ++round) {
      const RowMatrix factor = inverse_factor(information_.matrix());
      if (factor.size() == 0) {
        return;
      }
      const Vector d = variances(rows_, factor);
      Indices givers;
      for (Index a = 0; a < d.size(); ++a) {
        if (weights_[member(a)] > 0) {
          givers.push_back(a);
        }
      }
      std::sort(givers.begin(), givers.end(), [&](Index a, Index b) { return d[a] < d[b]; });
      const std::vector<double> least = least_givers(givers, member, d);
      std::vector<Taker> takers;
      for (Index a = 0; a < d.size(); ++a) {
        const double excess = d[a] - at(least, group(member(a)));
        if (weights_[member(a)] < problem_.upper - 2 * kLeastMove && excess > 0) {
          takers.push_back({excess, a});
        }
      }
      if (takers.empty()) {
        return;
      }
      std::sort(takers.begin(), takers.end());
      takers.resize(std::min(takers.size(), givers.size()));
      for (Index k = 0; k < size_of(takers); ++k) {
        give_first(givers, k, at(takers, k).member, d);
      }
      for (Index k = 0; k < size_of(takers); ++k) {
        const Index giver = at(givers, random_.below(size_of(givers)));
        move(giver, at(takers, random_.below(size_of(takers))).member);
      }
    }
  }

  void give_first(const Indices& givers, Index first, Index taker, const Vector& d) {
    for (Index offset = 0; offset < size_of(givers); ++offset) {
      const Index giver = at(givers, (first + offset) % size_of(givers));
      if (d[giver] < d[taker] && move(giver, taker)) {
        return;
      }
    }
  }

  // Whether the bounds allowed it.
  bool move(Index giver, Index taker) {
    const Index from = at(active_, giver);
    const Index to = at(active_, taker);
    double limit = std::min(weights_[from], problem_.upper - weights_[to]);
    if (group(from) != group(to)) {
      limit = std::min({limit, at(sums_, group(from)) - at(problem_.groups.lower, group(from)),
                        at(problem_.groups.upper, group(to)) - at(sums_, group(to))});
    }
    if (from == to || limit <= kLeastMove) {
      return false;
    }
    const RowMatrix from_rows = rows_.rows(giver);
    const RowMatrix to_rows = rows_.rows(taker);
    double step = best_step(information_, from_rows, to_rows, limit);
    if (step <= 0) {
      return true;
    }
    step = weights_[from] - step < 2 * kLeastMove ? weights_[from] : step;
    information_.add(to_rows.data(), shape_.rows, step);
    information_.add(from_rows.data(), shape_.rows, -step);
    weights_[from] -= step;
    weights_[to] += step;
    at(sums_, group(from)) -= step;
    at(sums_, group(to)) += step;
    return true;
  }

  const DesignProblem& problem_;
  Random& random_;
  Shape shape_;
  Vector weights_;
  std::vector<double> sums_;  // of each group
  Information information_;
  Indices active_;
  ColumnBlocks rows_;  // of the active candidates
};

}  // namespace

ApproximateDesign optimise_design(const DesignProblem& problem, Vector weights,
                                  const DesignOptions& options, Random& random) {
  return DesignOptimiser(problem, std::move(weights), random).run(options);
}

Vector starting_weights(const ColumnBlocks& candidates, const RowMatrix& fixed, double total) {
  const Index n = candidates.count();
  Information information(fixed + kGreedyRidge * RowMatrix::Identity(fixed.rows(), fixed.cols()));
  Products products(candidates);
  products.compute(inverse_factor(information.matrix()));
  Vector weights = Vector::Zero(n);
  for (Index k = 0; k < static_cast<Index>(total); ++k) {
    check_interrupt();
    Index best = -1;
    for (Index j = 0; j < n; ++j) {
      if (weights[j] == 0 && (best < 0 || products.trace(j) > products.trace(best))) {
        best = j;
      }
    }
    weights[best] = 1;
    information.add(candidates.rows(best).data(), candidates.shape().rows, 1, &products);
  }
  // The ridge alone would make the smallest eigenvalue kGreedyRidge.
  const RowMatrix ridged = inverse_factor(information.matrix());
  const bool singular = ridged.rowwise().squaredNorm().maxCoeff() > 0.1 / kGreedyRidge;
  return singular ? Vector::Constant(n, total / static_cast<double>(n)) : weights;
}

}  // namespace symkin::design::detail
