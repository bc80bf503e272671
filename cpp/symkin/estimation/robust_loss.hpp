// SPDX-License-Identifier: MIT
#pragma once

#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "symkin/support/types.hpp"

namespace ceres {
class LossFunction;
}

namespace symkin {

// A pose whose weight falls below this is called rejected.
inline constexpr double kRejectedWeight = 0.5;

// A kind of loss: ceres::LossFunctions that differ in where they bend. It acts on d^2, d the norm
// of the whitened conditions of one block: a leg's closures at a pose, or all that a pose says.
// Where it bends by default follows from the function itself, so whoever adds a loss writes its
// function and this, and those that have a name are one line in robust_loss.cpp.
struct LossFamily {
  // Where its fit starts, because a loss that forgets what is far off has several minima.
  enum class Start {
    least_squares,  // convex
    two,            // from Huber's fit and from subsets of the poses, whichever ends lower
    cauchy,         // from Cauchy's fit
  };

  std::string name;
  Start start;
  // rho(s) of s = d^2 with rho'(0) = 1 that bends at d = bend: rho(s) = bend^2 rho_1(s / bend^2).
  std::unique_ptr<ceres::LossFunction> (*make)(double bend);

  void check() const;  // throws InvalidInput
};

// What a fit does with residuals that are no noise.
struct RobustLoss {
  const LossFamily* family = nullptr;  // null: least squares
  // The d at which the loss bends, over the root of the number of conditions in a block; 0: where
  // it keeps 95% efficiency on normal residuals, which grows less than that root.
  double scale = 0;
  // Standard deviation of the whitened residuals that are noise: 1 where the declared noise holds;
  // 0: the S scale of the residuals, taken once.
  double spread = 1;

  bool any() const { return family != nullptr; }
  void check() const;  // throws InvalidInput
};

// "none" and those that have a name: "huber", "cauchy", "tukey".
std::vector<std::string> loss_names();
// Throws InvalidInput for a name that there is none of, saying those there are.
RobustLoss loss_named(std::string_view name, double scale = 0);

// Where the loss keeps 95% efficiency on normal blocks of so many conditions:
//   efficiency = b^2 / a,  a = E[(w d)^2] / k,  b = E[psi'(d) / k + (1 - 1/k) w],  d ~ chi_k;
// of more than six, where that leaves hardly any weight, where as many sound blocks are kept as of
// six, with more than 95%.
double bend_of(const LossFamily& family, Index conditions);

// A loss on blocks of one number of conditions, with all that its statistics need.
class BlockLoss {
 public:
  // Without a family that of least squares. `spread` takes the place of the loss's own.
  BlockLoss(const RobustLoss& loss, Index conditions, double spread);
  BlockLoss(const BlockLoss& other);
  BlockLoss(BlockLoss&& other) noexcept;
  BlockLoss& operator=(BlockLoss other) noexcept;
  ~BlockLoss();

  bool any() const { return family_ != nullptr; }
  Index conditions() const { return conditions_; }
  // Where it bends, in whitened residuals.
  double bend() const { return bend_; }
  // Of a squared norm: what it adds to the cost, its weight and the derivative of that, where the
  // residual's own noise is `relative` times that of the whitened.
  struct Value {
    double cost, weight, by_square;
    // How psi(d) grows, over the directions of the block: psi'(d) / k + (1 - 1/k) w.
    double slope(double square, Index conditions) const {
      return weight + 2 * square * by_square / static_cast<double>(conditions);
    }
  };
  Value at(double square, double relative = 1) const;
  // The same as Ceres takes it; null for least squares.
  std::unique_ptr<ceres::LossFunction> function(double relative = 1) const;

  // Mean and variance of d^2 / spread^2 of sound blocks that keep a weight of one half at least;
  // and of what is left by a fit whose parameters take the share h of all conditions: to first
  // order the mean is (1 - taken h) times that.
  struct Kept {
    double limit;  // of d / spread
    double share, mean, variance, taken;
  };
  const Kept& kept() const { return kept_; }
  static Kept untruncated(Index conditions);

 private:
  Index conditions_;
  double bend_ = 0;
  double spread_;
  const LossFamily* family_;
  std::unique_ptr<ceres::LossFunction> function_;
  Kept kept_;
};

// Of blocks with different numbers of conditions.
class BlockLosses {
 public:
  explicit BlockLosses(const RobustLoss& loss) : BlockLosses(loss, loss.spread) {}
  BlockLosses(const RobustLoss& loss, double spread) : loss_(loss), spread_(spread) {}

  const RobustLoss& loss() const { return loss_; }
  double spread() const { return spread_; }
  bool any() const { return loss_.any(); }
  // Made when it is asked for first, so not for several threads.
  const BlockLoss& of(Index conditions);

 private:
  RobustLoss loss_;
  double spread_;
  std::list<BlockLoss> made_;  // references to them last
};

}  // namespace symkin
