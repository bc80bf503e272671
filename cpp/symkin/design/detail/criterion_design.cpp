// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "symkin/design/detail/bounds.hpp"
#include "symkin/design/detail/criteria.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin::design::detail {
namespace {

constexpr int kRounds = 7;   // passes over all candidates
constexpr int kSteps = 600;  // of weight between two passes
constexpr int kBisections = 12;
constexpr double kLeastGain = 1e-7;  // of the logarithm of the criterion
constexpr Index kActive = 200;
// Of the expected error, where Newton's method takes these steps.
constexpr Index kFavoured = 1000;
constexpr double kTight = 1e-5;      // between the bound and the weights' error
constexpr int kModels = 4;           // between two passes
constexpr Index kTakers = 128;       // candidates without weight so far, on a model
constexpr Index kMovesEach = 10;     // for each candidate of a model
constexpr double kGainLeft = 0.005;  // of the first move's, when a model is left

constexpr double kFirstSharpness = 2;  // doubled in each round up to
constexpr double kSharpness = 16;

// The rounding of T and of the sums; their condition is that of M.
constexpr double kSlack = 1e-9;

class DesignSearch {
 public:
  DesignSearch(const Problem& problem, Criterion criterion, const Indices& chosen)
      : problem_(problem),
        options_(criterion_options(problem.options, criterion)),
        active_(chosen),
        weights_(chosen.size(), 1.0),
        information_(problem.information(chosen)) {
    reach(chosen);
  }

  CriterionDesign run() {
    const bool above = criterion() != Criterion::expected_error;
    double best = above ? kInfinity : 0;
    if (!(reached_ > 0)) {  // too ill-conditioned for anything to be said
      return {best, by_weight()};
    }
    if (criterion() == Criterion::O4) {  // O4 = O2 O3
      o2_bound_ = bound_of(Criterion::O2);
      o3_bound_ = bound_of(Criterion::O3);
    }
    for (int round = 0; round < kRounds; ++round) {
      sharpness_ = std::min(kSharpness, kFirstSharpness * std::pow(2.0, round));
      const LargestRatio bound = at_information();
      best = above ? std::min(best, bound.value) : std::max(best, bound.value);
      activate(bound.favoured);
      if (above) {
        improve();
      } else if (improve_error() * (1 - kTight) <= best) {
        break;
      }
      if (criterion() == Criterion::O4) {
        reach(problem_.rounded(by_weight()));
      }
    }
    return {best * (above ? 1 + kSlack : 1 - kSlack), by_weight()};
  }

 private:
  Criterion criterion() const { return options_.criterion; }

  // What the criteria look at; poses of millions of candidates stay where they are.
  static SelectionOptions criterion_options(const SelectionOptions& given, Criterion criterion) {
    SelectionOptions options;
    options.criterion = criterion;
    options.column_scale = given.column_scale;
    options.error_weight = given.error_weight;
    return options;
  }

  double bound_of(Criterion other) const {
    return DesignSearch(problem_, other, active_).run().bound;
  }

  // T whose columns belong to parameters in their unit.
  RowMatrix in_units(const RowMatrix& root) const {
    const Vector& scale = options_.column_scale;
    return scale.size() == 0 ? root : RowMatrix(root * scale.cwiseInverse().asDiagonal());
  }

  RowMatrix normalised_root(const RowMatrix& gradient) const {
    const RowMatrix root = lower_root(gradient);
    return root / in_units(root).norm();
  }

  Index kept() const {
    const bool error = criterion() == Criterion::expected_error;
    return std::max(error ? kFavoured : kActive, 2 * problem_.free_count);
  }

  // The bound with T the gradient at the present weights.
  LargestRatio at_information() const {
    const CriterionGradient gradient = criterion_gradient(information_, options_, sharpness_);
    const RowMatrix gain = normalised_root(gradient.gain);
    if (criterion() == Criterion::O4) {
      return of_o4(gain, normalised_root(gradient.loss));
    }
    LargestRatio top =
        criterion() == Criterion::O2
            ? largest_ratio(problem_, {gain, normalised_root(gradient.loss), 0}, kept())
            : largest_trace(problem_, gain, kept());
    switch (criterion()) {
      case Criterion::O2:
      case Criterion::O3:
        return {std::sqrt(top.value), std::move(top.favoured)};
      case Criterion::O5: {
        const double size = std::pow(singular_values(in_units(gain)).array().pow(2.0 / 3).sum(), 3);
        return {std::sqrt(top.value / size), std::move(top.favoured)};
      }
      default: {
        const RowMatrix root = lower_root(options_.error_weight);
        const double size = singular_values(product(gain, root.transpose())).sum();
        return {size * size / top.value, std::move(top.favoured)};
      }
    }
  }

  // O4 <= a / sqrt(b) with a and b the traces of gain and loss. A set that is better than the
  // best one known has sqrt(b) between low and high, where a chord of the root lies below it.
  LargestRatio of_o4(const RowMatrix& gain, const RowMatrix& loss) const {
    const double low = reached_ / (o2_bound_ * o2_bound_);
    const double high = std::max(low, o3_bound_ * o3_bound_ / reached_);
    LargestRatio top = largest_ratio(problem_, {gain, loss, low * high}, kept());
    const double bound = std::max(reached_, (low + high) * top.value);
    return {std::min(bound, o2_bound_ * o3_bound_), std::move(top.favoured)};
  }

  void activate(const std::vector<RankedCandidate>& favoured) {
    for (const RankedCandidate& candidate : favoured) {
      if (!contains(active_, candidate.index)) {
        active_.push_back(candidate.index);
        weights_.push_back(0);
      }
    }
    const Index p = information_.rows();
    const Index before = size_of(rows_);
    squares_.conservativeResize(size_of(active_), p * (p + 1) / 2);
    for (Index j = before; j < size_of(active_); ++j) {
      rows_.push_back(problem_.candidates.rows(at(active_, j)));
      squares_.row(j) = lower_triangle(square_of(j), 1).transpose();
    }
  }

  RowMatrix square_of(Index j) const { return product(at(rows_, j).transpose(), at(rows_, j)); }

  // By rows; what stands beside the diagonal times a factor.
  static Vector lower_triangle(const RowMatrix& matrix, double beside) {
    Vector result(matrix.rows() * (matrix.rows() + 1) / 2);
    for (Index a = 0, first = 0; a < matrix.rows(); first += ++a) {
      result.segment(first, a) = beside * matrix.row(a).head(a).transpose();
      result[first + a] = matrix(a, a);
    }
    return result;
  }

  void reach(const Indices& chosen) {
    if (size_of(chosen) == problem_.free_count) {
      const double value = criterion_value(problem_.information(chosen), options_);
      reached_ = value > reached_ ? value : reached_;
    }
  }

  Indices by_weight() const {
    Indices order;
    for (Index j = 0; j < size_of(active_); ++j) {
      if (at(weights_, j) > 0) {
        order.push_back(j);
      }
    }
    std::sort(order.begin(), order.end(), [&](Index a, Index b) {
      return std::make_pair(-at(weights_, a), at(active_, a)) <
             std::make_pair(-at(weights_, b), at(active_, b));
    });
    return named(order, active_);
  }

  RowMatrix gradient_at(const RowMatrix& information) const {
    return criterion_gradient(information, options_, sharpness_).total();
  }

  // Weight goes from the candidate that the criterion misses least to the one that it gains most
  // from, as much as is best.
  void improve() {
    for (int step = 0; step < kSteps; ++step) {
      check_interrupt();
      const Vector gains = squares_ * lower_triangle(gradient_at(information_), 2);
      Index giver = size_of(active_);
      Index taker = giver;
      double least = kInfinity;
      double most = -least;
      for (Index j = 0; j < gains.size(); ++j) {
        if (at(weights_, j) > 0 && gains[j] < least) {
          least = gains[j];
          giver = j;
        }
        if (at(weights_, j) < 1 && gains[j] > most) {
          most = gains[j];
          taker = j;
        }
      }
      if (!(most - least > kLeastGain)) {
        return;
      }
      const RowMatrix direction = square_of(taker) - square_of(giver);
      const double limit = std::min(at(weights_, giver), 1 - at(weights_, taker));
      const double moved = best_step(criterion_rises(direction), limit);
      if (moved <= 0) {
        return;
      }
      at(weights_, giver) -= moved;
      at(weights_, taker) += moved;
      information_ += moved * direction;
    }
  }

  // Newton's method for the expected error f = trace(M^-1 B), as for log det: f has the slopes
  // -trace(C_j M^-1 B M^-1 C_j^T) in the weights, and the curvatures 2 sum (C_j M^-1 C_k^T) o (C_j
  // M^-1 B M^-1 C_k^T) over all elements. On this model weight goes from the candidate that loses
  // least to the one that gains most; then f is made least on the way there. Returns f before that.
  double improve_error() {
    double error = 0;
    for (int model = 0; model < kModels; ++model) {
      check_interrupt();
      const ErrorSlopes slopes = error_slopes(information_, options_.error_weight);
      error = slopes.error;
      const Indices places = on_model(squares_ * lower_triangle(slopes.weighted, 2));
      const Index r = at(rows_, 0).rows();
      RowMatrix rows(size_of(places) * r, information_.cols());
      Vector weights(size_of(places));
      for (Index j = 0; j < weights.size(); ++j) {
        rows.middleRows(j * r, r) = at(rows_, at(places, j));
        weights[j] = at(weights_, at(places, j));
      }
      const RowMatrix weighted = product(rows, slopes.weighted);
      const Vector change =
          moved(weights, sums_of_blocks(weighted.cwiseProduct(rows).rowwise().sum(), r),
                curvatures_of(rows, product(rows, slopes.inverse), weighted, r)) -
          weights;
      if (change.isZero(0)) {
        break;
      }
      const Vector of_rows = change.transpose().replicate(r, 1).reshaped();
      const RowMatrix direction = product(rows.transpose() * of_rows.asDiagonal(), rows);
      const double share = best_step(criterion_rises(direction), 1);
      for (Index j = 0; j < weights.size(); ++j) {
        at(weights_, at(places, j)) = weights[j] + share * change[j];
      }
      information_ += share * direction;
    }
    return error;
  }

  // Those with weight, and those without that gain most from some.
  Indices on_model(const Vector& gains) const {
    Indices with;
    Indices without;
    for (Index j = 0; j < gains.size(); ++j) {
      (at(weights_, j) > 0 ? with : without).push_back(j);
    }
    const Index wanted = std::min(kTakers, size_of(without));
    std::nth_element(
        without.begin(), without.begin() + wanted, without.end(),
        [&](Index a, Index b) { return std::pair(-gains[a], a) < std::pair(-gains[b], b); });
    with.insert(with.end(), without.begin(), without.begin() + wanted);
    return with;
  }

  static Vector sums_of_blocks(const Vector& values, Index r) {
    return values.reshaped(r, values.size() / r).colwise().sum();
  }

  static RowMatrix curvatures_of(const RowMatrix& rows, const RowMatrix& solved,
                                 const RowMatrix& weighted, Index r) {
    const RowMatrix terms =
        product(solved, rows.transpose()).cwiseProduct(product(weighted, rows.transpose()));
    const Index n = rows.rows() / r;
    RowMatrix result(n, n);
    for (Index j = 0; j < n; ++j) {
      const Vector of_block = terms.middleRows(j * r, r).colwise().sum();
      result.row(j) = 2 * sums_of_blocks(of_block, r).transpose();
    }
    return result;
  }

  // The weights after moves between two candidates at a time, with these slopes and curvatures.
  static Vector moved(Vector weights, Vector slopes, const RowMatrix& curvatures) {
    double least = 0;
    for (Index move = 0; move < kMovesEach * weights.size(); ++move) {
      Index giver = -1;
      Index taker = -1;
      for (Index j = 0; j < weights.size(); ++j) {
        giver = weights[j] > 0 && (giver < 0 || slopes[j] < slopes[giver]) ? j : giver;
        taker = weights[j] < 1 && (taker < 0 || slopes[j] > slopes[taker]) ? j : taker;
      }
      const double gain = giver < 0 || taker < 0 ? 0 : slopes[taker] - slopes[giver];
      if (!(gain > least)) {
        break;
      }
      least = move == 0 ? kGainLeft * gain : least;
      const double curvature =
          curvatures(giver, giver) + curvatures(taker, taker) - 2 * curvatures(giver, taker);
      const double room = std::min(weights[giver], 1 - weights[taker]);
      const double step = gain < room * curvature ? gain / curvature : room;
      weights[giver] -= step;
      weights[taker] += step;
      slopes -= step * (curvatures.row(taker) - curvatures.row(giver)).transpose();
    }
    return weights;
  }

  // Whether the criterion rises at a step along a direction.
  std::function<bool(double)> criterion_rises(const RowMatrix& direction) const {
    return [this, &direction](double step) {
      const RowMatrix moved = information_ + step * direction;
      return inverse_factor(moved).size() != 0 &&
             gradient_at(moved).cwiseProduct(direction).sum() > 0;
    };
  }

  // Along a line the criterion rises and then falls: bisection of its slope.
  static double best_step(const std::function<bool(double)>& rises, double limit) {
    if (rises(limit)) {
      return limit;
    }
    double low = 0;
    double high = limit;
    for (int i = 0; i < kBisections; ++i) {
      const double middle = (low + high) / 2;
      (rises(middle) ? low : high) = middle;
    }
    return low;
  }

  const Problem& problem_;
  const SelectionOptions options_;
  Indices active_;
  std::vector<double> weights_;  // of the active candidates, in [0, 1]
  std::vector<RowMatrix> rows_;  // of the active candidates: C
  RowMatrix squares_;            // the lower triangle of C^T C, a row a candidate
  RowMatrix information_;
  double sharpness_ = kFirstSharpness;
  double reached_ = 0;  // the largest value of a selection so far
  double o2_bound_ = 0;
  double o3_bound_ = 0;
};

}  // namespace

CriterionDesign criterion_design(const Problem& problem, const Indices& chosen) {
  return DesignSearch(problem, problem.options.criterion, chosen).run();
}

}  // namespace symkin::design::detail
