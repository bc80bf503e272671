// SPDX-License-Identifier: MIT
#include <string>
#include <utility>

#include "symkin/estimation/detail/leg_estimators.hpp"
#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// Whitened closures, a block a pose.
WhitenedSystem system_of(const LegData& data, const WhitenedLeg& leg) {
  WhitenedSystem system;
  system.jacobian = leg.factors.asDiagonal() * leg.rows.by_parameters;
  system.residual = leg.rows.closure.cwiseProduct(leg.factors);
  const Index closures = data.model.info().closures;
  for (Index pose = 1; pose <= data.readings.size(); ++pose) {
    system.first.push_back(pose * closures);
  }
  return system;
}

// A leg as fit_robustly() takes it.
class RobustLeg {
 public:
  RobustLeg(const LegData& data, Index leg, const Vector& start, WhitenedLeg whitened,
            const IdentificationOptions& options)
      : data_(&data), leg_(leg), start_(&start), options_(&options) {
    now_.parameters = start;
    now_.whitened = std::move(whitened);
    now_.outcome.converged = true;
  }

  void solve(BlockLosses& losses) {
    const BlockLoss& loss = losses.of(data_->model.info().closures);
    const int before = now_.outcome.iterations;
    // What a stage has spoilt is no start for the next.
    if (!now_.outcome.converged) {
      set(*start_);
    }
    now_ = fit_by_ceres(*data_, now_.parameters, loss, *options_);
    now_.outcome.iterations += before;
  }
  bool converged() const { return now_.outcome.converged; }
  double cost() const { return now_.cost; }
  WhitenedSystem system() const { return system_of(*data_, now_.whitened); }
  void move(const Vector& change) {
    Vector moved = now_.parameters;
    moved(data_->estimated) += change;
    set(moved);
  }
  std::vector<Index> guard(const WhitenedSystem& system) const {
    return unguarded(system, options_->loss, "leg " + std::to_string(leg_ + 1), data_->rows);
  }
  LegEstimate& estimate() { return now_; }

 private:
  void set(const Vector& parameters) {
    now_.parameters = parameters;
    whiten(*data_, now_.parameters, options_->noise, now_.whitened);
  }

  const LegData* data_;
  Index leg_;
  const Vector* start_;
  const IdentificationOptions* options_;
  LegEstimate now_;
};

// Squares of the whitened closures, pose by pose; of `inverse`, which does not weigh poses by their
// noise, those that are left by a step to where the weighted closures are least.
Vector squares_of(const WhitenedSystem& system, const LegEstimate& estimate, bool weighted) {
  Vector change = Vector::Zero(system.jacobian.cols());
  if (!weighted) {
    const Vector roots = estimate.loss_weights.cwiseSqrt();
    change = -scaled_least_squares(roots.asDiagonal() * system.jacobian,
                                   roots.cwiseProduct(system.residual));
  }
  return system.squares(change);
}

}  // namespace

LegEstimate estimate_leg(const LegData& data, Index leg, const Vector& start, WhitenedLeg whitened,
                         const IdentificationOptions& options) {
  RobustLeg problem(data, leg, start, std::move(whitened), options);
  const RobustLoss loss = options.estimator == Estimator::joint ? RobustLoss{} : options.loss;
  auto [losses, open] = fit_robustly(problem, loss);
  LegEstimate& estimate = problem.estimate();
  if (loss.any()) {
    const WhitenedSystem system = problem.system();
    const std::vector<Index> conditions(static_cast<std::size_t>(system.count()),
                                        data.model.info().closures);
    estimate.unguarded = std::move(open);
    estimate.robust =
        robust_statistics(squares_of(system, estimate, options.estimator == Estimator::implicit),
                          conditions, system.jacobian.cols(), losses);
  }
  return std::move(estimate);
}

}  // namespace symkin
