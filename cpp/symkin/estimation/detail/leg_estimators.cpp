// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/leg_estimators.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// Starts as Gauss-Newton, which needs a handful of steps; damped when a step fails.
constexpr double kFirstDamping = 0;
// Of a standard deviation: the joint fit goes much further from where the legs' own begin it. With
// a loss it may end elsewhere.
constexpr double kJointStart = 1e-2;
// Of a standard deviation, and the most that a step of weights may still go where Newton's take
// over.
constexpr double kSettles = 1e-3;

// The residuals of a leg over their standard deviations, which are taken anew with the robust
// weights wherever the solver goes.
class LegProblem {
 public:
  // Closures whitened at the start, or g - psi.
  LegProblem(const LegData& data, const Vector& start, WhitenedLeg whitened, const BlockLoss& loss,
             const IdentificationOptions& options, LegWorkspace& room)
      : data_(data),
        options_(options),
        loss_(loss),
        in_readings_(options.estimator == Estimator::inverse),
        room_(room) {
    now_.parameters = start;
    now_.leg = std::move(whitened);
    if (in_readings_) {
      linearise_in_readings();
    }
  }

  Index size() const { return static_cast<Index>(data_.estimated.size()); }

  bool linearise(NormalEquations& equations) {
    if (moved_) {
      in_readings_ ? linearise_in_readings()
                   : whiten(data_, now_.parameters, options_.noise, now_.leg);
    }
    const Vector& raw = errors();
    residuals_ = raw.cwiseProduct(now_.leg.factors);
    equations.cost = weigh(now_, now_.weights);
    squares_ = now_.weights.cwiseProduct(now_.leg.factors.cwiseAbs2());
    const RowMatrix& by_parameters = now_.leg.rows.by_parameters;
    weighted_square(by_parameters, squares_, raw, equations.information, equations.gradient);
    equations.by_new_weights = 0;
    if (moved_) {
      residuals_ = raw.cwiseProduct(former_.leg.factors);
      equations.by_new_weights = equations.cost - weigh(former_, unused_);
    }
    return std::isfinite(equations.cost) && equations.gradient.allFinite();
  }

  void step(const Vector& d) {
    std::swap(now_, former_);
    now_.parameters = former_.parameters;
    now_.parameters(data_.estimated) += d;
    moved_ = true;
  }
  void undo() { std::swap(now_, former_); }
  bool latents_at_rest() const { return true; }
  double step_size(const Vector& d) const { return relative_step(data_, now_.parameters, d); }
  bool orthogonal_step(Vector& d) const {
    const Vector roots = squares_.cwiseSqrt();
    d = -scaled_least_squares(roots.asDiagonal() * now_.leg.rows.by_parameters,
                              roots.cwiseProduct(errors()));
    return true;
  }

  // Where the solver ended.
  const Vector& errors() const { return now_.leg.rows.closure; }
  LegEstimate take(SolverOutcome outcome) {
    LegEstimate estimate;
    estimate.parameters = std::move(now_.parameters);
    estimate.outcome = std::move(outcome);
    estimate.cost = room_.solver.now.cost;
    estimate.loss_weights = std::move(now_.weights);
    estimate.whitened = std::move(now_.leg);
    return estimate;
  }

 private:
  void linearise_in_readings() {
    linearise_readings(data_, now_.parameters, now_.leg.rows);
    // One factor for all poses, so that the cost stays the paper's.
    if (!moved_ || loss_.any()) {
      now_.relative = reading_deviations(data_, now_.parameters, options_.noise);
      deviation_ =
          std::sqrt(now_.relative.squaredNorm() / static_cast<double>(now_.relative.size()));
      now_.relative /= deviation_;
    }
    now_.leg.factors.setConstant(data_.readings.size(), 1 / deviation_);
  }

  // The cost of the residuals and their weights, by the deviations of a state.
  double weigh(const LegWorkspace::State& by, Vector& weights) const {
    weights.setOnes(residuals_.size());
    if (!loss_.any()) {
      return residuals_.squaredNorm();
    }
    const Index closures = loss_.conditions();
    double cost = 0;
    for (Index k = 0; k < residuals_.size(); k += closures) {
      const BlockLoss::Value value = loss_.at(residuals_.segment(k, closures).squaredNorm(),
                                              in_readings_ ? by.relative[k] : 1);
      cost += value.cost;
      weights.segment(k, closures).setConstant(value.weight);
    }
    return cost;
  }

  const LegData& data_;
  const IdentificationOptions& options_;
  const BlockLoss& loss_;
  bool in_readings_;
  bool moved_ = false;
  double deviation_ = 1;
  LegWorkspace& room_;
  LegWorkspace::State &now_ = room_.now, &former_ = room_.former;
  Vector &residuals_ = room_.residuals, &squares_ = room_.squares, &unused_ = room_.unused;
};

}  // namespace

LegEstimate estimate_paper(const LegData& data, const Vector& start,
                           const IdentificationOptions& options) {
  LegEstimate estimate;
  estimate.parameters = start;
  estimate.loss_weights = Vector::Ones(data.readings.size());
  SolverOutcome& outcome = estimate.outcome;
  ClosureRows rows;
  for (; outcome.iterations < options.max_iterations; ++outcome.iterations) {
    linearise_readings(data, estimate.parameters, rows);
    if (!rows.closure.allFinite()) {
      outcome.failure = "iteration " + std::to_string(outcome.iterations + 1) + " put " +
                        unreached_pose(rows.closure) + " of the leg out of its reach";
      break;
    }
    // Eq. 25, by QR rather than by the inverse of C'C. Its sign: with errors g - psi the update
    // of Eq. 26 must be subtracted.
    const Vector step = scaled_least_squares(rows.by_parameters, rows.closure);
    estimate.parameters(data.estimated) -= step;
    if (relative_step(data, estimate.parameters, step) < 1e-11) {
      outcome.converged = true;
      break;
    }
  }
  if (!outcome.converged && outcome.failure.empty()) {
    outcome.failure = "no convergence in " + std::to_string(options.max_iterations) + " iterations";
  }
  whiten(data, estimate.parameters, options.noise, estimate.whitened);
  return estimate;
}

LegEstimate fit_by_steps(const LegData& data, const Vector& start, WhitenedLeg whitened,
                         const BlockLoss& loss, const IdentificationOptions& options,
                         LegWorkspace& room) {
  LegProblem problem(data, start, std::move(whitened), loss, options, room);
  SolverOptions how{loss.any() ? kRobustSteps * options.max_iterations : options.max_iterations,
                    kFirstDamping};
  if (loss.any()) {
    how.step_tolerance = kSettles;
  } else if (options.estimator == Estimator::joint) {
    how.step_tolerance = kJointStart;
  }
  SolverOutcome outcome = minimise(problem, how, room.solver);
  if (options.estimator == Estimator::inverse && !problem.errors().allFinite()) {
    outcome.failure = out_of_reach_at_start(problem.errors());
  }
  LegEstimate estimate = problem.take(std::move(outcome));
  if (loss.any()) {
    // Weights may also go round without an end that Newton's steps find.
    const bool ended =
        std::exchange(estimate.outcome.converged, settle(data, loss, options, estimate));
    if (estimate.outcome.converged) {
      estimate.outcome.failure.clear();
    } else if (ended) {
      how.step_tolerance = SolverOptions().step_tolerance;
      LegProblem rest(data, Vector(estimate.parameters), std::move(estimate.whitened), loss,
                      options, room);
      estimate = rest.take(minimise(rest, how, room.solver));
    }
  }
  if (options.estimator == Estimator::inverse) {
    whiten(data, estimate.parameters, options.noise, estimate.whitened);
  }
  return estimate;
}

}  // namespace symkin
