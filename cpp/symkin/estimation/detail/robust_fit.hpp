// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/estimation/robust_loss.hpp"

namespace symkin {

// How far each block alone decides what the fit makes of it: the mean of its rows' leverages.
Vector leverages(const WhitenedSystem& system);

// Up to kGuarded a loss keeps its promise for up to 10% gross errors; up to kMostLeverage only
// Cauchy's does, and an error of that block would not be seen. Both are read off simulations.
inline constexpr double kGuarded = 0.5;
inline constexpr double kMostLeverage = 0.75;

// The blocks that are not guarded. Throws InvalidInput where the loss cannot keep its promise,
// saying what can be done; `whose` fit it is, and `names` of the system, counted from 0.
std::vector<Index> unguarded(const WhitenedSystem& system, const RobustLoss& loss,
                             const std::string& whose, const std::vector<Index>& names);

// Where subsets of the blocks lead that fit the best half of all: the S estimate (Tukey's function,
// 50% breakdown) as a change of the parameters, and its scale. The subsets are always the same.
struct SubsetStart {
  Vector change;
  double scale = 1;
};
SubsetStart best_of_subsets(const WhitenedSystem& system);

// The constant of the S scale s: sum rho(d / s) = (n - p/k) E rho.
double s_scale_bend(Index conditions);

// What a loss leaves of the statistics of a fit.
struct RobustStatistics {
  double variance = 1;  // the covariance is so many times the inverse of the weighted information
  // Of Student's t, which errors over their deviations follow.
  double student_degrees = std::numeric_limits<double>::infinity();
  Index kept = 0;             // blocks that are not rejected
  double sum_of_squares = 0;  // of these, and of the priors
  // As of untruncated normal conditions.
  double chi_square = 0;
  double degrees_of_freedom = 0;
};
// Of blocks with squared norms `squares` and so many conditions, fitted by `parameters`; of the
// priors their number and squares.
RobustStatistics robust_statistics(const Vector& squares, const std::vector<Index>& conditions,
                                   Index parameters, BlockLosses& losses, Index priors = 0,
                                   double prior_squares = 0);

// The order of fits: least squares; Huber's; from there and from subsets Cauchy's, the lower of the
// two; what is neither from Cauchy's. Each with the scale held. A Problem is copied and assigned
// and has
//   void solve(BlockLosses&);       fits from its present state
//   bool converged() const;
//   double cost() const;            of that fit
//   WhitenedSystem system() const;  at the present state
//   void move(const Vector&);       by a change of the parameters
//   std::vector<Index> guard(const WhitenedSystem&) const;   see unguarded()
// Returns the losses that the problem was fitted with, and what they do not guard.
template <typename Problem>
std::pair<BlockLosses, std::vector<Index>> fit_robustly(Problem& problem, const RobustLoss& loss);

// What leads to the fit with a loss, which is the last of these: nothing without one.
std::vector<RobustLoss> stages_of(const RobustLoss& loss);

namespace detail {

// From Huber's fit and from subsets. Where Huber's loss rejects nothing there is nothing that a
// subset could leave out.
template <typename Problem>
void fit_from_two(Problem& problem, BlockLosses& losses, BlockLosses& huber) {
  const WhitenedSystem system = problem.system();
  const Vector squares = system.squares(Vector::Zero(system.jacobian.cols()));
  bool rejects = !problem.converged();
  for (Index i = 0; i < system.count(); ++i) {
    rejects = rejects || huber.of(system.conditions(i)).at(squares[i]).weight < kRejectedWeight;
  }
  if (!rejects) {
    problem.solve(losses);
    return;
  }
  constexpr double kLower = 1e-9;  // of the cost: equal minima are one
  Problem other = problem;
  other.move(best_of_subsets(system).change);
  other.solve(losses);
  problem.solve(losses);
  if (other.converged() && (!problem.converged() || other.cost() < problem.cost() * (1 - kLower))) {
    problem = std::move(other);
  }
}

}  // namespace detail

template <typename Problem>
std::pair<BlockLosses, std::vector<Index>> fit_robustly(Problem& problem, const RobustLoss& loss) {
  BlockLosses none{RobustLoss{}};
  problem.solve(none);
  if (!loss.any()) {
    return {none, {}};
  }
  const WhitenedSystem system = problem.system();
  std::vector<Index> unguarded = problem.guard(system);
  const double spread = loss.spread > 0 ? loss.spread : best_of_subsets(system).scale;
  std::vector<BlockLosses> stages;
  for (const RobustLoss& stage : stages_of(loss)) {
    stages.emplace_back(stage, spread);
    if (stage.family->start == LossFamily::Start::two) {
      BlockLosses huber = stages[stages.size() - 2];
      detail::fit_from_two(problem, stages.back(), huber);
    } else {
      problem.solve(stages.back());
    }
  }
  return {std::move(stages.back()), std::move(unguarded)};
}

}  // namespace symkin
