// SPDX-License-Identifier: MIT
#include "symkin/selection/error_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "symkin/selection/information.hpp"
#include "symkin/selection/roots.hpp"
#include "symkin/selection/screening.hpp"

namespace symkin {
namespace {

constexpr int kRounds = 6;   // passes over all candidates
constexpr int kSteps = 300;  // of weight between two passes
constexpr Index kActive = 200;

// The rounding of T and of the sums; their condition is that of W.
constexpr double kSlack = 1e-9;

struct Gradient {
  double error = 0;  // f
  RowMatrix root;    // lower T with T^T T = W^-1 B W^-1
  double fixed = 0;  // trace(W^-1 B W^-1 F)
};

Gradient gradient_at(const RowMatrix& w, const RowMatrix& b, const RowMatrix& fixed) {
  const RowMatrix factor = inverse_factor(w);
  const RowMatrix inverse = factor.transpose() * factor;
  const RowMatrix weighted = inverse * b * inverse;
  return {(inverse * b).trace(), lower_root(weighted), weighted.cwiseProduct(fixed).sum()};
}

// The weight in [0, limit] to move so that trace(W^-1 B) becomes least: convex, by bisection of the
// derivative.
double best_step(const RowMatrix& w, const RowMatrix& direction, const RowMatrix& b, double limit) {
  const auto slope = [&](double step) {
    const RowMatrix factor = inverse_factor(w + step * direction);
    if (factor.size() == 0) {
      return 1.0;
    }
    const RowMatrix inverse = factor.transpose() * factor;
    return -(inverse * b * inverse).cwiseProduct(direction).sum();
  };
  if (slope(limit) <= 0) {
    return limit;
  }
  double low = 0;
  double high = limit;
  for (int i = 0; i < 12; ++i) {
    const double middle = (low + high) / 2;
    (slope(middle) <= 0 ? low : high) = middle;
  }
  return low;
}

// Weights in [0, 1] of the active candidates, made better for `steps` pairs.
void improve(const std::vector<RowMatrix>& outer, const RowMatrix& b, std::vector<double>& weights,
             RowMatrix& w) {
  for (int step = 0; step < kSteps; ++step) {
    const RowMatrix factor = inverse_factor(w);
    const RowMatrix inverse = factor.transpose() * factor;
    const RowMatrix weighted = inverse * b * inverse;
    std::size_t giver = 0;
    std::size_t taker = 0;
    double least = std::numeric_limits<double>::infinity();
    double most = 0;
    for (std::size_t j = 0; j < outer.size(); ++j) {
      const double q = weighted.cwiseProduct(outer[j]).sum();
      if (weights[j] > 0 && q < least) {
        least = q;
        giver = j;
      }
      if (weights[j] < 1 && q > most) {
        most = q;
        taker = j;
      }
    }
    if (!(most > least * (1 + 1e-6))) {
      return;
    }
    const RowMatrix direction = outer[taker] - outer[giver];
    const double moved = best_step(w, direction, b, std::min(weights[giver], 1 - weights[taker]));
    if (moved <= 0) {
      return;
    }
    weights[giver] -= moved;
    weights[taker] += moved;
    w += moved * direction;
  }
}

}  // namespace

double expected_error_bound(const SelectionProblem& problem, const std::vector<Index>& chosen) {
  const RowMatrix& b = problem.options.error_weight;
  std::vector<Index> active = chosen;
  std::vector<double> weights(chosen.size(), 1.0);
  RowMatrix w = problem.information(chosen);
  double bound = 0;
  for (int round = 0; round < kRounds; ++round) {
    const Gradient gradient = gradient_at(w, b, problem.fixed);
    const auto top = screen_candidates(problem.candidates,
                                       {{gradient.root, std::max(kActive, 2 * problem.free_count)}})
                         .front();
    const double sum = gradient.fixed + largest_sum(top, problem.free_count);
    bound = std::max(bound, gradient.error * gradient.error / sum * (1 - kSlack));
    for (const RankedCandidate& candidate : top) {
      if (std::find(active.begin(), active.end(), candidate.index) == active.end()) {
        active.push_back(candidate.index);
        weights.push_back(0);
      }
    }
    std::vector<RowMatrix> outer;
    for (const Index candidate : active) {
      const RowMatrix c = problem.candidates.rows(candidate);
      outer.push_back(c.transpose() * c);
    }
    improve(outer, b, weights, w);
  }
  return bound;
}

}  // namespace symkin
