// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "symkin/design/detail/bounds.hpp"
#include "symkin/design/detail/information.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kLeastMove = 1e-10;   // less room for weight is none
constexpr double kExcessLeft = 0.02;   // of the first step's, when a model is left
constexpr Index kStepsEach = 10;       // on a model, for each of the active candidates at most
constexpr Index kMostTakers = 256;     // without weight so far, on a model
constexpr int kHalvings = 30;          // of the way to what the model says
constexpr double kGreedyRidge = 1e-3;  // of the whitened unit information

// Newton's method: log det has the slopes d_j = |T C_j^T|^2 and, negated, the curvatures
// h_jk = |T C_j^T C_k T^T|^2 (Frobenius norms) of the weights. The maximum of this model over the
// weights of the active candidates is approached by moving weight between two at a time, from the
// one that loses least to the one that gains most; then log det is made largest on the way there.
class DesignOptimiser {
 public:
  DesignOptimiser(const DesignProblem& problem, Vector weights)
      : problem_(problem), shape_(problem.candidates.shape()) {
    result_.weights = std::move(weights);
  }

  ApproximateDesign run(const DesignOptions& options) {
    const auto p = static_cast<double>(shape_.parameters);
    for (int iteration = 0;; ++iteration) {
      check_interrupt();
      evaluate();
      const double gap = p * std::log(std::max(1.0, result_.trace / p));
      if (gap <= options.gap || result_.log_det + gap <= options.target ||
          gap <= options.share * (result_.log_det - options.target) ||
          iteration >= options.iterations) {
        return std::move(result_);
      }
      choose_active();
      improve();
    }
  }

 private:
  Index group(Index j) const { return at(problem_.groups.of, j); }

  // M, its inverse and all variances from the weights.
  void evaluate() {
    sums_.assign(problem_.groups.lower.size(), 0);
    active_.clear();
    for (Index j = 0; j < result_.weights.size(); ++j) {
      if (result_.weights[j] > 0) {
        at(sums_, group(j)) += result_.weights[j];
        active_.push_back(j);
      }
    }
    const RowMatrix rows = problem_.candidates.rows(active_);
    const RowMatrix matrix = problem_.fixed + weighted(rows, result_.weights(active_));
    result_.factor = demanded_factor(matrix);
    result_.log_det = log_determinant(result_.factor);
    result_.variances = variances(problem_.candidates, result_.factor);
    result_.trace = (result_.factor * problem_.fixed).cwiseProduct(result_.factor).sum();
    add_largest_sum();
  }

  // rows' diag(weights) rows, with a weight a candidate.
  RowMatrix weighted(const RowMatrix& rows, const Vector& weights) const {
    const Vector of_rows = weights.transpose().replicate(shape_.rows, 1).reshaped();
    return product(rows.transpose() * of_rows.asDiagonal(), rows);
  }

  // The largest sum w_j d_j that the weights' bounds allow, above trace(M^-1 (M_S - fixed)) of any
  // set S. Greedy is exact for bounds on disjoint groups: first what every group must hold, then
  // the best of the rest that groups still have room for.
  void add_largest_sum() {
    const DesignGroups& groups = problem_.groups;
    const auto places = [&](double weight) {
      return static_cast<std::ptrdiff_t>(std::round(weight / problem_.upper));
    };
    std::vector<std::vector<double>> of_group(groups.lower.size());
    for (Index j = 0; j < result_.weights.size(); ++j) {
      at(of_group, group(j)).push_back(result_.variances[j]);
    }
    result_.least = kInfinity;
    const auto take = [&](auto first, auto last) {
      for (; first != last; ++first) {
        result_.trace += problem_.upper * *first;
        result_.least = std::min(result_.least, *first);
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

  // For a taker in each group the active candidate of least slope that may give to it: one of the
  // group or, if that has room, one of any group that may lose weight. Negative if there is none.
  void find_givers() {
    givers_.assign(sums_.size(), -1);
    Index anywhere = -1;
    const auto replace = [&](Index& giver, Index other) {
      giver = giver < 0 || slopes_[other] < slopes_[giver] ? other : giver;
    };
    for (Index a = 0; a < weights_.size(); ++a) {
      if (weights_[a] > 0) {
        const Index g = group(at(active_, a));
        replace(at(givers_, g), a);
        if (may_lose(g)) {
          replace(anywhere, a);
        }
      }
    }
    for (Index g = 0; g < size_of(givers_) && anywhere >= 0; ++g) {
      if (may_gain(g)) {
        replace(at(givers_, g), anywhere);
      }
    }
  }

  // What is gained by moving weight to a candidate of this slope and group, to first order.
  double excess(double slope, Index g) const {
    return at(givers_, g) < 0 ? 0 : slope - slopes_[at(givers_, g)];
  }

  // Those with weight and as many again that gain most by taking some.
  void choose_active() {
    weights_ = result_.weights(active_);
    slopes_ = result_.variances(active_);
    find_givers();
    std::vector<std::pair<double, Index>> takers;
    for (Index j = 0; j < result_.weights.size(); ++j) {
      const double gain = excess(result_.variances[j], group(j));
      if (result_.weights[j] == 0 && gain > 0) {
        takers.emplace_back(-gain, j);
      }
    }
    const Index wanted =
        std::min({size_of(takers), size_of(active_) + result_.weights.size() / 64, kMostTakers});
    std::nth_element(takers.begin(), takers.begin() + wanted, takers.end());
    for (Index k = 0; k < wanted; ++k) {
      active_.push_back(at(takers, k).second);
    }
    weights_ = result_.weights(active_);
    slopes_ = result_.variances(active_);
  }

  void improve() {
    const RowMatrix z = product(problem_.candidates.rows(active_), result_.factor.transpose());
    const RowMatrix curvatures = curvatures_of(z);
    double least = 0;
    for (Index step = 0; step < kStepsEach * weights_.size(); ++step) {
      find_givers();
      Index taker = -1;
      double most = least;
      for (Index a = 0; a < weights_.size(); ++a) {
        const double gain = excess(slopes_[a], group(at(active_, a)));
        if (gain > most && weights_[a] < problem_.upper - kLeastMove) {
          most = gain;
          taker = a;
        }
      }
      if (taker < 0) {
        break;
      }
      least = step == 0 ? kExcessLeft * most : least;
      move(at(givers_, group(at(active_, taker))), taker, most, curvatures);
    }
    const Vector change = weights_ - result_.weights(active_);
    const double share = best_share(weighted(z, change));
    result_.weights(active_) = share == 1 ? weights_ : Vector(weights_ - (1 - share) * change);
  }

  // |z_j z_k^T|^2 of all pairs of active candidates: of p parameters and r rows it is the product
  // of r^2 numbers for each of p, or of z_j^T z_j and z_k^T z_k as p (p + 1) / 2 numbers.
  RowMatrix curvatures_of(const RowMatrix& z) const {
    const Index r = shape_.rows;
    const Index p = z.cols();
    if (r == 1) {
      return product(z, z.transpose()).cwiseAbs2();
    }
    const Index n = z.rows() / r;
    if (2 * r * r > p) {
      RowMatrix squares(n, p * (p + 1) / 2);
      for (Index j = 0; j < n; ++j) {
        const auto rows = z.middleRows(j * r, r);
        squares.row(j) = symmetric_part(product(rows.transpose(), rows));
      }
      return product(squares, squares.transpose());
    }
    RowMatrix result(n, n);
    for (Index j = 0; j < n; ++j) {
      const RowMatrix products = product(z.middleRows(j * r, r), z.transpose());
      const Vector squares = products.colwise().squaredNorm();
      result.row(j) = squares.reshaped(r, n).colwise().sum();
    }
    return result;
  }

  // The lower triangle by rows, so that products of two are those of the matrices.
  static Eigen::RowVectorXd symmetric_part(const RowMatrix& matrix) {
    Eigen::RowVectorXd result(matrix.rows() * (matrix.rows() + 1) / 2);
    for (Index a = 0, first = 0; a < matrix.rows(); first += ++a) {
      result.segment(first, a) = std::sqrt(2.0) * matrix.row(a).head(a);
      result[first + a] = matrix(a, a);
    }
    return result;
  }

  void move(Index giver, Index taker, double gain, const RowMatrix& curvatures) {
    const Index from = group(at(active_, giver));
    const Index to = group(at(active_, taker));
    double step = std::min(weights_[giver], problem_.upper - weights_[taker]);
    if (from != to) {
      step = std::min({step, at(sums_, from) - at(problem_.groups.lower, from),
                       at(problem_.groups.upper, to) - at(sums_, to)});
    }
    const double curvature =
        curvatures(giver, giver) + curvatures(taker, taker) - 2 * curvatures(giver, taker);
    step = gain < step * curvature ? gain / curvature : step;
    weights_[giver] -= step;
    weights_[taker] += step;
    at(sums_, from) -= step;
    at(sums_, to) += step;
    slopes_ -= step * (curvatures.row(taker) - curvatures.row(giver)).transpose();
  }

  // The t in [0, 1] for which log det(I + t change) is largest.
  static double best_share(const RowMatrix& change) {
    const Eigen::ArrayXd values = symmetric_eigenvalues(change);
    const auto rises = [&](double share) {
      const Eigen::ArrayXd terms = 1 + share * values;
      return terms.minCoeff() > 0 && (values / terms).sum() > 0;
    };
    if (rises(1)) {
      return 1;
    }
    double share = 0;
    double width = 1;
    for (int i = 0; i < kHalvings; ++i) {
      width /= 2;
      share += rises(share + width) ? width : 0;
    }
    return share;
  }

  const DesignProblem& problem_;
  Shape shape_;
  ApproximateDesign result_;
  Indices active_;
  Vector weights_, slopes_;   // of the active candidates, as the model has them
  std::vector<double> sums_;  // of the weights of each group
  Indices givers_;            // for each group, places among the active candidates
};

}  // namespace

ApproximateDesign optimise_design(const DesignProblem& problem, Vector weights,
                                  const DesignOptions& options) {
  return DesignOptimiser(problem, std::move(weights)).run(options);
}

Vector starting_weights(const ColumnBlocks& candidates, const RowMatrix& fixed, double total) {
  const Index n = candidates.count();
  Information information(fixed + kGreedyRidge * RowMatrix::Identity(fixed.rows(), fixed.cols()));
  Products products(candidates);
  products.compute(inverse_factor(information.matrix()));
  Indices taken;
  // The ridge alone would make the smallest eigenvalue kGreedyRidge.
  const auto singular = [&] {
    const RowMatrix ridged = inverse_factor(information.matrix());
    return ridged.rowwise().squaredNorm().maxCoeff() > 0.1 / kGreedyRidge;
  };
  while (static_cast<double>(size_of(taken)) < total || singular()) {
    check_interrupt();
    if (size_of(taken) == n) {
      break;
    }
    const Index best = products.largest();
    taken.push_back(best);
    products.hide(best);
    products.update(information.add(candidates.rows(best).data(), candidates.shape().rows, 1));
  }
  Vector weights = Vector::Zero(n);
  weights(taken).setConstant(total / static_cast<double>(taken.size()));
  return weights;
}

}  // namespace symkin::design::detail
