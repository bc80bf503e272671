// SPDX-License-Identifier: MIT
#include <ceres/loss_function.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>

#include "symkin/estimation/detail/chi.hpp"
#include "symkin/estimation/detail/robust_fit.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr int kSubsets = 80;
constexpr std::uint64_t kSeed = 25;

// Tukey's function over its largest value, and its weight.
struct Bounded {
  double value, weight;
};
Bounded tukey(double square, double bend) {
  std::array<double, 3> rho{};
  ceres::TukeyLoss(bend).Evaluate(square, rho.data());
  std::array<double, 3> most{};
  ceres::TukeyLoss(bend).Evaluate(4 * bend * bend, most.data());
  return {rho[0] / most[0], rho[1]};
}

class Subsets {
 public:
  explicit Subsets(const WhitenedSystem& blocks) : blocks_(blocks) {
    order_.resize(static_cast<std::size_t>(blocks.count()));
    std::iota(order_.begin(), order_.end(), Index{0});
    weights_.setOnes(blocks.residual.size());
    while (least_ < blocks.count() &&
           blocks.first[static_cast<std::size_t>(least_)] + blocks.residual.size() - blocks.rows() <
               blocks.jacobian.cols()) {
      ++least_;
    }
    half_ = std::min((blocks.count() + least_ + 1) / 2, blocks.count());
  }

  // The blocks first in the order have weight one, all others none.
  bool fit_first(Index count, Vector& change) {
    weights_.head(blocks_.rows()).setZero();
    for (Index i = 0; i < count; ++i) {
      set_weight(order_[static_cast<std::size_t>(i)], 1);
    }
    return fit(change);
  }
  void set_weight(Index block, double weight) {
    weights_.segment(blocks_.first[static_cast<std::size_t>(block)], blocks_.conditions(block))
        .setConstant(weight);
  }
  bool fit(Vector& change) {
    constexpr double kPoor = 1e-11;  // what hardly determines the parameters leads nowhere
    weighted_square(blocks_.jacobian, weights_, blocks_.residual, information_, gradient_);
    cholesky_.compute(information_);
    if (!(cholesky_.least_pivot() > kPoor)) {
      return false;
    }
    cholesky_.solve(gradient_, change);
    change = -change;
    return change.allFinite();
  }

  void draw(Random& random) {
    for (Index i = 0; i < least_; ++i) {
      std::swap(order_[static_cast<std::size_t>(i)],
                order_[static_cast<std::size_t>(i + random.below(blocks_.count() - i))]);
    }
  }
  Index least() const { return least_; }

  // Puts the best half first; the sum of its squares.
  double halve(const Vector& change) {
    const Vector squares = blocks_.squares(change);
    std::nth_element(order_.begin(), order_.begin() + half_ - 1, order_.end(),
                     [&](Index a, Index b) { return squares[a] < squares[b]; });
    double sum = 0;
    for (Index i = 0; i < half_; ++i) {
      sum += squares[order_[static_cast<std::size_t>(i)]];
    }
    return sum;
  }
  // Fits the best half, again and again until it loses no more.
  double concentrate(Vector& change, int most) {
    double best = halve(change);
    for (int step = 0; step < most; ++step) {
      Vector next = change;
      if (!fit_first(half_, next)) {
        break;
      }
      const double sum = halve(next);
      const bool lower = sum < best * (1 - 1e-9);
      if (sum <= best) {
        change = next;
        best = sum;
      }
      if (!lower) {
        break;
      }
    }
    return best;
  }

 private:
  const WhitenedSystem& blocks_;
  std::vector<Index> order_;
  Vector weights_, gradient_;
  RowMatrix information_;
  ScaledCholesky cholesky_;
  Index least_ = 0;  // blocks that may determine the parameters
  Index half_ = 0;
};

// One step of the scale towards sum rho(d / s) = (n - p/k) E rho.
double next_scale(const WhitenedSystem& blocks, const Vector& squares, double scale) {
  double sum = 0;
  double expected = 0;
  const double share =
      1 - static_cast<double>(blocks.jacobian.cols()) / static_cast<double>(blocks.residual.size());
  for (Index i = 0; i < blocks.count(); ++i) {
    sum += tukey(squares[i] / (scale * scale), s_scale_bend(blocks.conditions(i))).value;
    expected += share / 2;
  }
  return scale * std::sqrt(sum / expected);
}

double first_scale(const WhitenedSystem& blocks, const Vector& squares) {
  std::vector<double> each;
  for (Index i = 0; i < blocks.count(); ++i) {
    each.push_back(squares[i] / static_cast<double>(blocks.conditions(i)));
  }
  std::nth_element(each.begin(), each.begin() + blocks.count() / 2, each.end());
  return std::sqrt(each[each.size() / 2]) / 0.6745;
}

}  // namespace

double s_scale_bend(Index conditions) {
  static std::mutex mutex;
  static std::map<Index, double> known;
  const std::lock_guard lock(mutex);
  const auto [bend, is_new] = known.try_emplace(conditions, 0);
  if (is_new) {
    double low = 0.1;
    double high = 30 * std::sqrt(static_cast<double>(conditions));
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = (low + high) / 2;
      const double mean =
          chi_expectation(conditions, middle, [&](double d) { return tukey(d * d, middle).value; });
      (mean > 0.5 ? low : high) = middle;
    }
    bend->second = (low + high) / 2;
  }
  return bend->second;
}

SubsetStart best_of_subsets(const WhitenedSystem& blocks) {
  constexpr int kSteps = 500;
  constexpr double kStill = 1e-10;  // of the scale
  Subsets subsets(blocks);
  Random random(kSeed);
  SubsetStart best{Vector::Zero(blocks.jacobian.cols()), 1};
  double least = subsets.concentrate(best.change, 2);
  for (int draw = 0; draw < kSubsets; ++draw) {
    subsets.draw(random);
    Vector change = best.change;
    if (!subsets.fit_first(subsets.least(), change)) {
      continue;
    }
    const double sum = subsets.concentrate(change, 2);
    if (sum < least) {
      least = sum;
      best.change = change;
    }
  }
  subsets.concentrate(best.change, kSteps);
  Vector squares = blocks.squares(best.change);
  best.scale = first_scale(blocks, squares);
  for (int step = 0; step < kSteps && best.scale > 0; ++step) {
    const double before = best.scale;
    best.scale = next_scale(blocks, squares, before);
    for (Index i = 0; i < blocks.count(); ++i) {
      subsets.set_weight(
          i,
          tukey(squares[i] / (best.scale * best.scale), s_scale_bend(blocks.conditions(i))).weight);
    }
    if (!subsets.fit(best.change)) {
      break;
    }
    squares = blocks.squares(best.change);
    if (std::abs(best.scale - before) < kStill * before) {
      break;
    }
  }
  return best;
}

}  // namespace symkin
